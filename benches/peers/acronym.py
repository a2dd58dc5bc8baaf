"""ACRONYM's simulated grasps against epsilon: candidates for `prehend close`, and the area under the curve.

    pip install h5py==3.16.0 numpy==2.4.6 trimesh==5.2.0 mujoco==4.0.0
    python acronym.py write GRASPS.h5 > candidates.jsonl                    # as they stand
    python acronym.py settle GRASPS.h5 MESH.obj 4 > candidates.jsonl        # every 4th, after the object has settled
    prehend close --hand PANDA --object MESH.obj --as-is --scale S candidates.jsonl --json > closed.jsonl
    python acronym.py score GRASPS.h5 closed.jsonl [4]

PANDA is what `prehend hand init` writes, with `break_away = ["panda_finger_joint2"]` in its hand.toml: each jaw closes until
it touches.

`settle` plays the closing in MuJoCo with the object free, as ACRONYM's simulation does: jaws of the URDF's boxes, coupled,
3 N each, friction 1, no gravity, half a second; the object's surface as one thin prism a triangle, its mass and inertia
from the file. The pose that it ends in is written with the jaws opened by 0.5 mm and more, and the hand drawn back: `score`
takes the first of the seven that does not start in collision.
"""

import json
import sys

import h5py
import numpy as np

# The gripper is open.
OPEN = 0.04
# A grasp's frame is the Panda's hand link turned about z: its jaws move along x there, along y in the URDF.
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
JAWS = ["panda_finger_joint1", "panda_finger_joint2"]
# How far the jaws are opened (m) after settling, and the hand drawn back.
OPENED = [(0.0005, 0), (0.001, 0), (0.002, 0), (0.002, 0.0005), (0.004, 0.0005), (0.004, 0.002), (0.008, 0.002)]
# Wider than this (m) between the jaws, a grasp holds the body from outside; else a wall, the rim or the handle.
WIDE = 0.06


def quaternion(m):
    w = np.sqrt(max(0.0, 1 + m[0, 0] + m[1, 1] + m[2, 2])) / 2
    x = np.sqrt(max(0.0, 1 + m[0, 0] - m[1, 1] - m[2, 2])) / 2 * (1 if m[2, 1] >= m[1, 2] else -1)
    y = np.sqrt(max(0.0, 1 - m[0, 0] + m[1, 1] - m[2, 2])) / 2 * (1 if m[0, 2] >= m[2, 0] else -1)
    z = np.sqrt(max(0.0, 1 - m[0, 0] - m[1, 1] + m[2, 2])) / 2 * (1 if m[1, 0] >= m[0, 1] else -1)
    q = np.array([w, x, y, z])
    return (q / np.linalg.norm(q)).tolist()


def line(translation, rotation, jaws):
    pose = {"translation": list(map(float, translation)), "quaternion_wxyz": quaternion(rotation)}
    print(json.dumps({"pose": pose, "joints": dict(zip(JAWS, jaws)), "approach": False}))


def area(scores, success):
    order = np.argsort(scores, kind="stable")
    ranks = np.empty(len(scores))
    ranks[order] = np.arange(1, len(scores) + 1)
    for value in np.unique(scores):
        same = scores == value
        ranks[same] = ranks[same].mean()
    n, m = success.sum(), (~success).sum()
    return (ranks[success].sum() - n * (n + 1) / 2) / (n * m) if n and m else float("nan")


def scene(file, mesh):
    """The object free, as prisms of 0.8 mm under its triangles; the gripper at the origin, its jaws coupled."""
    touch = 'friction="1 0.002 0.0001" condim="4" solref="0.003 1" solimp="0.95 0.99 0.0005"'
    xml = [
        '<mujoco><compiler angle="radian" autolimits="true"/><option timestep="0.001" integrator="implicitfast" '
        'cone="elliptic" impratio="10" gravity="0 0 0"/><size memory="200M"/>'
        '<default><geom contype="0" conaffinity="0"/></default><asset>'
    ]
    for k, corners in enumerate(mesh.triangles):
        middle = corners.mean(0)
        inner = middle + 0.6 * (corners - middle) - 0.0008 * mesh.face_normals[k]
        points = " ".join(f"{v:.9g}" for v in np.vstack([corners, inner]).ravel())
        xml.append(f'<mesh name="p{k}" vertex="{points}"/>')
    com, inertia = file["object/com"][:], file["object/inertia"][:]
    i = [inertia[0, 0], inertia[1, 1], inertia[2, 2], inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    xml.append(
        f'</asset><worldbody><body name="object"><freejoint/><inertial pos="{com[0]} {com[1]} {com[2]}" '
        f'mass="{file["object/mass"][()]}" fullinertia="{" ".join(map(str, i))}"/>'
    )
    xml += [f'<geom type="mesh" mesh="p{k}" contype="1" conaffinity="2" {touch}/>' for k in range(len(mesh.faces))]
    touch += ' contype="2" conaffinity="1"'
    xml.append(f'</body><body name="hand"><geom type="box" size=".018 .1 .04" pos="0 0 .02617" {touch}/>')
    boxes = [
        (".011 .0075 .01", 0.0185, 0.011, 0),
        (".011 .0044 .0019", 0.0068, 0.0022, 0),
        (".00875 .0035 .01175", 0.0159, 0.02835, 0.5235987755982988),
        (".00875 .0076 .00925", 0.00758, 0.04525, 0),
    ]
    for sign, name in ((1, "left"), (-1, "right")):
        xml.append(
            f'<body name="{name}" pos="0 0 .0584"><inertial pos="0 0 0" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/>'
            f'<joint name="{name}" type="slide" axis="0 {sign} 0" range="0 0.04" damping="10"/>'
        )
        for size, y, z, turn in boxes:
            xml.append(f'<geom type="box" size="{size}" pos="0 {sign * y} {z}" euler="{sign * turn} 0 0" {touch}/>')
        xml.append("</body>")
    xml.append(
        '</body></worldbody><equality><joint joint1="right" joint2="left" polycoef="0 1 0 0 0"/></equality>'
        '<actuator><motor joint="left"/><motor joint="right"/></actuator></mujoco>'
    )
    return "\n".join(xml)


def settle(file, path, every):
    import mujoco
    import trimesh

    mesh = trimesh.load(path, force="mesh")
    mesh.apply_scale(float(file["object/scale"][()]))
    model = mujoco.MjModel.from_xml_string(scene(file, mesh))
    for matrix in file["grasps/transforms"][:][::every]:
        data = mujoco.MjData(model)
        object_from_hand = matrix.copy()
        object_from_hand[:3, :3] = matrix[:3, :3] @ TURN
        hand_from_object = np.linalg.inv(object_from_hand)
        data.qpos[:3] = hand_from_object[:3, 3]
        data.qpos[3:7] = quaternion(hand_from_object[:3, :3])
        data.qpos[7:9] = OPEN
        data.ctrl[:] = -3.0
        for _ in range(500):
            mujoco.mj_step(model, data)
            data.qvel[:6] *= 0.999
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, data.qpos[3:7])
        rotation = rotation.reshape(3, 3).T
        translation = -rotation @ data.qpos[:3]
        for opened, back in OPENED:
            jaws = [float(np.clip(q + opened, 0.0, OPEN)) for q in data.qpos[7:9]]
            line(translation - back * rotation[:, 2], rotation, jaws)


def score(file, path, every):
    flex = file["grasps/qualities/flex"]
    success = flex["object_in_gripper"][:][::every] > 0
    moved = flex["object_motion_during_closing_linear"][:][::every]
    closed = [json.loads(text) for text in open(path)]
    n = len(closed) // len(success)
    chosen = []
    for first in range(0, n * len(success), n):
        several = closed[first : first + n]
        usable = [c for c in several if "error" not in c and c["reason"] != "start-collision"]
        chosen.append(usable[0] if usable else several[0])
    epsilon = np.array([c.get("epsilon") or 0.0 for c in chosen])
    width = np.array([sum(c.get("joints", {}).get(j, 0.0) for j in JAWS) for c in chosen])
    for name, these in (("all", width >= 0), ("body from outside", width > WIDE), ("wall, rim, handle", width <= WIDE)):
        s, e = success[these], epsilon[these]
        print(
            f"{name}: {len(s)} grasps, {s.sum()} succeeded; area under the curve {area(e, s):.3f}; "
            f"force closure {np.mean(e[s] > 0):.2f} of those that succeeded, {np.mean(e[~s] > 0):.2f} of the others; "
            f"by how little the object moved while ACRONYM's gripper closed, {area(-moved[these], s):.3f}"
        )
    reasons = {}
    for c, s in zip(chosen, success):
        key = c.get("reason") or ("error" if "error" in c else "kept")
        reasons.setdefault(key, [0, 0])[int(s)] += 1
    for reason, (failed, succeeded) in sorted(reasons.items()):
        print(f"  {reason}: {succeeded} succeeded, {failed} failed")


def main():
    command, file = sys.argv[1], h5py.File(sys.argv[2])
    every = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    if command == "write":
        for matrix in file["grasps/transforms"][:]:
            line(matrix[:3, 3], matrix[:3, :3] @ TURN, [OPEN, OPEN])
    elif command == "settle":
        settle(file, sys.argv[3], every)
    else:
        score(file, sys.argv[3], every)


main()
