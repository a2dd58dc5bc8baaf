"""Shows grasps that `prehend export --format json` wrote, in Rerun.

    pip install rerun-sdk trimesh numpy
    prehend export grasps.parquet --top 10 --format json --out exported
    python examples/python/show_in_rerun.py exported/schunk_sdh_coffee_mug.json

The mesh is drawn as its file has it; where a NAME.toml beside it scales or turns it, give the scaled mesh as a second
argument.
"""

import json
import sys

import numpy as np
import rerun as rr
import trimesh

file = json.load(open(sys.argv[1]))
mesh = trimesh.load(sys.argv[2] if len(sys.argv) > 2 else file["mesh"], force="mesh")
rr.init("prehend", spawn=True)
rr.log("object", rr.Mesh3D(vertex_positions=mesh.vertices, triangle_indices=mesh.faces), static=True)
for number, grasp in enumerate(file["grasps"]):
    rr.set_time("grasp", sequence=number)
    for name, pose in (("pregrasp", grasp["pregrasp"]["pose"]), ("grasp", grasp["pose"])):
        w, x, y, z = pose["quaternion_wxyz"]
        rr.log(name, rr.Transform3D(translation=pose["translation"], quaternion=[x, y, z, w]))
        rr.log(f"{name}/axes", rr.Arrows3D(vectors=0.03 * np.eye(3), colors=255 * np.eye(3)))
    points = np.array([c["point"] for c in grasp["contacts"]])
    normals = np.array([c["normal"] for c in grasp["contacts"]])
    rr.log("contacts", rr.Arrows3D(origins=points - 0.02 * normals, vectors=0.02 * normals))
    rr.log("epsilon", rr.Scalars(grasp["epsilon"]))
