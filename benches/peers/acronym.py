"""Candidate lines for `prehend close` from an ACRONYM file, and the area under the curve of epsilon against success.

    pip install h5py==3.16.0 numpy
    python acronym.py write GRASPS.h5 > candidates.jsonl
    prehend close --hand PANDA --object MUG --as-is --scale S candidates.jsonl --json > closed.jsonl
    python acronym.py score GRASPS.h5 closed.jsonl
"""
import json, sys
import h5py
import numpy as np

# The gripper is open.
OPEN = 0.04
# A grasp's frame is the Panda's hand link turned about z: its jaws move along x there, along y in the URDF.
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def quaternion(m):
    w = np.sqrt(max(0.0, 1 + m[0, 0] + m[1, 1] + m[2, 2])) / 2
    x = np.sqrt(max(0.0, 1 + m[0, 0] - m[1, 1] - m[2, 2])) / 2 * (1 if m[2, 1] >= m[1, 2] else -1)
    y = np.sqrt(max(0.0, 1 - m[0, 0] + m[1, 1] - m[2, 2])) / 2 * (1 if m[0, 2] >= m[2, 0] else -1)
    z = np.sqrt(max(0.0, 1 - m[0, 0] - m[1, 1] + m[2, 2])) / 2 * (1 if m[1, 0] >= m[0, 1] else -1)
    q = np.array([w, x, y, z])
    return (q / np.linalg.norm(q)).tolist()


def area(scores, success):
    order = np.argsort(scores, kind="stable")
    ranks = np.empty(len(scores))
    ranks[order] = np.arange(1, len(scores) + 1)
    for value in np.unique(scores):
        same = scores == value
        ranks[same] = ranks[same].mean()
    n, m = success.sum(), (~success).sum()
    return (ranks[success].sum() - n * (n + 1) / 2) / (n * m)


def main():
    file = h5py.File(sys.argv[2])
    if sys.argv[1] == "write":
        for matrix in file["grasps/transforms"][:]:
            pose = {"translation": matrix[:3, 3].tolist(), "quaternion_wxyz": quaternion(matrix[:3, :3] @ TURN)}
            print(json.dumps({"pose": pose, "joints": {"panda_finger_joint1": OPEN}, "approach": False}))
        return
    success = file["grasps/qualities/flex/object_in_gripper"][:] > 0
    closed = [json.loads(line) for line in open(sys.argv[3])]
    epsilon = np.array([c.get("epsilon") or 0.0 for c in closed])
    reasons = {}
    for c, s in zip(closed, success):
        key = c.get("reason") or c.get("error", "kept")
        reasons.setdefault(key, [0, 0])[int(s)] += 1
    print(f"{len(closed)} grasps, {success.sum()} succeeded; area under the curve of epsilon {area(epsilon, success):.3f}")
    for reason, (failed, succeeded) in sorted(reasons.items()):
        print(f"  {reason}: {succeeded} succeeded, {failed} failed")


main()
