"""Does a grasp hold in MuJoCo? Plays scenes that `prehend export --format mjcf` wrote.

    pip install mujoco==4.0.0
    python hold.py SCENE.xml… > outcomes.jsonl
    python hold.py --table GRASPS.jsonl outcomes.jsonl…      # GRASPS.jsonl from `prehend grasps`: holding by epsilon

The servos close from the grasp's posture towards the squeeze for half a second without gravity, then gravity pulls for
half a second from each of six directions, each time from the squeezed state anew. A grasp holds in a direction where the
object ends less than 30 mm from where it was and some link still touches it. One JSON line a scene, and a summary on
standard error.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np

SETTLE = 0.5
PULL = 0.5
MOVED = 0.03
# What `prehend export` squeezes with, N.
GRIP = 60.0


def play(path):
    model = mujoco.MjModel.from_xml_path(path)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    start_depth = min((c.dist for c in data.contact), default=0.0)
    n_start = data.ncon
    for _ in range(int(SETTLE / model.opt.timestep)):
        mujoco.mj_step(model, data)
    shift = float(np.linalg.norm(data.qpos[:3]))
    n_squeezed = data.ncon
    state = (data.qpos.copy(), data.qvel.copy(), data.act.copy())
    held = []
    for direction in np.vstack([np.eye(3), -np.eye(3)]):
        data.qpos[:], data.qvel[:] = state[0], state[1]
        model.opt.gravity[:] = 9.81 * direction
        for _ in range(int(PULL / model.opt.timestep)):
            mujoco.mj_step(model, data)
        moved = float(np.linalg.norm(data.qpos[:3] - state[0][:3]))
        held.append(bool(moved < MOVED and data.ncon > 0 and np.isfinite(moved)))
    return {
        "scene": path,
        "weight": 9.81 * float(model.body("object").mass[0]),
        "contacts_at_start": int(n_start),
        "depth_at_start": -float(min(start_depth, 0.0)),
        "moved_by_squeeze": shift,
        "contacts_squeezed": int(n_squeezed),
        "held": held,
    }


def summary(outcomes):
    n = max(len(outcomes), 1)
    every = sum(all(o["held"]) for o in outcomes)
    directions = sum(sum(o["held"]) for o in outcomes)
    lost = sum(o["moved_by_squeeze"] >= MOVED for o in outcomes)
    return (
        f"{len(outcomes)} grasps: {every} ({100 * every / n:.0f} %) hold in all six directions, "
        f"{100 * directions / (6 * n):.0f} % of grasps and directions; {lost} lost by the squeeze alone"
    )


def table(grasps, files):
    epsilon, place = {}, {}
    for text in open(grasps):
        row = json.loads(text)
        epsilon[row["grasp_id"].replace("/", "_")] = row["qeps"]
        place[row["grasp_id"].replace("/", "_")] = f"{row['hand']}, {row['object']}"
    outcomes = [json.loads(text) for file in files for text in open(file)]
    for o in outcomes:
        o["epsilon"], o["place"] = epsilon[Path(o["scene"]).stem], place[Path(o["scene"]).stem]
        o["ratio"] = GRIP * o["epsilon"] / o["weight"]
    print(summary(outcomes))
    for name in sorted(set(o["place"] for o in outcomes)):
        print(f"  {name}: {summary([o for o in outcomes if o['place'] == name])}")
    for low, high in ((0, 0.02), (0.02, 0.05), (0.05, 0.1), (0.1, 9)):
        these = [all(o["held"]) for o in outcomes if low <= o["epsilon"] < high]
        print(f"  epsilon {low} to {high}: {len(these)} grasps, {100 * np.mean(these) if these else 0:.0f} % hold")
    for low, high in ((0, 0.1), (0.1, 0.25), (0.25, 0.5), (0.5, 1), (1, 2), (2, 99)):
        these = [all(o["held"]) for o in outcomes if low <= o["ratio"] < high]
        share = 100 * np.mean(these) if these else 0
        print(f"  epsilon times grip over weight {low} to {high}: {len(these)} grasps, {share:.0f} % hold")
    held = np.array([all(o["held"]) for o in outcomes])
    for name in ("epsilon", "ratio"):
        e = np.array([o[name] for o in outcomes])
        wins = (e[held][:, None] > e[~held]).mean() + 0.5 * (e[held][:, None] == e[~held]).mean()
        print(f"  area under the curve of {name} against holding: {wins:.2f}")
    for name, these in (("hold", held), ("fail", ~held)):
        moved = [o["moved_by_squeeze"] for o, h in zip(outcomes, these) if h]
        print(f"  those that {name}: moved by the squeeze {1000 * np.median(moved):.1f} mm in the median")
    directions = np.array([o["held"] for o in outcomes])
    print(f"  share lost by direction +x +y +z -x -y -z: {np.round(1 - directions.mean(0), 3).tolist()}")


def main():
    if sys.argv[1] == "--table":
        table(sys.argv[2], sys.argv[3:])
        return
    outcomes = []
    for path in sys.argv[1:]:
        outcomes.append(play(path))
        print(json.dumps(outcomes[-1]), flush=True)
    print(summary(outcomes), file=sys.stderr)


main()
