"""Does a grasp hold in MuJoCo? Plays scenes that `prehend export --format mjcf` wrote.

    pip install mujoco==4.0.0
    python hold.py SCENE.xml… > outcomes.jsonl

The servos close from the grasp's posture towards the squeeze for half a second without gravity, then gravity pulls for
half a second from each of six directions, each time from the squeezed state anew. A grasp holds in a direction where the
object ends less than 30 mm from where it was and some link still touches it. One JSON line a scene, and a summary on
standard error.
"""

import json
import sys

import mujoco
import numpy as np

SETTLE = 0.5
PULL = 0.5
MOVED = 0.03


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
        "contacts_at_start": int(n_start),
        "depth_at_start": -float(min(start_depth, 0.0)),
        "moved_by_squeeze": shift,
        "contacts_squeezed": int(n_squeezed),
        "held": held,
    }


def main():
    outcomes = []
    for path in sys.argv[1:]:
        outcomes.append(play(path))
        print(json.dumps(outcomes[-1]), flush=True)
    n = max(len(outcomes), 1)
    every = sum(all(o["held"]) for o in outcomes)
    directions = sum(sum(o["held"]) for o in outcomes)
    lost = sum(o["moved_by_squeeze"] >= MOVED for o in outcomes)
    print(
        f"{len(outcomes)} grasps: {every} ({100 * every / n:.0f} %) hold in all six directions, "
        f"{100 * directions / (6 * n):.0f} % of grasps and directions; {lost} lost by the squeeze alone",
        file=sys.stderr,
    )


main()
