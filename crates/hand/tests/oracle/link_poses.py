"""Writes link_poses.json: where yourdfpy puts every link of some hands in random postures.

    pip install yourdfpy==0.0.60
    python link_poses.py ../../../../hands SHARED_HANDS > link_poses.json

One line a hand and posture: folder, URDF, positions of the free joints, and per link the upper three rows of its pose
in the root link's frame (row by row).
"""

import json
import sys
from pathlib import Path

import numpy as np
import yourdfpy

BUNDLED = ["human/human.urdf", "schunk_sdh/schunk_sdh.urdf"]
SHARED = [
    "allegro_hand/allegro_hand_right.urdf",
    "barrett_hand/bhand_model.urdf",
    "panda_gripper/panda_gripper.urdf",
    "schunk_sdh/schunk_sdh.urdf",
]


def postures(path, n, rng):
    urdf = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
    free = [j for j in urdf.actuated_joints if j.mimic is None]
    for _ in range(n):
        joints = {j.name: float(rng.uniform(j.limit.lower, j.limit.upper)) for j in free}
        urdf.update_cfg(joints)
        poses = {}
        for link in urdf.link_map:
            matrix = urdf.get_transform(link, urdf.base_link)
            poses[link] = [float(x) for x in np.asarray(matrix)[:3].ravel()]
        yield {"joints": joints, "poses": poses}


def main():
    rng = np.random.default_rng(20101018)
    lines = []
    for kind, folder, paths in (("bundled", sys.argv[1], BUNDLED), ("shared", sys.argv[2], SHARED)):
        for path in paths:
            for posture in postures(Path(folder) / path, 3, rng):
                lines.append(json.dumps({"kind": kind, "urdf": path, **posture}))
    print("[\n" + ",\n".join(lines) + "\n]")


main()
