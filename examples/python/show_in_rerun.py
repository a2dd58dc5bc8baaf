"""Shows grasps that `prehend export --format json` wrote, in Rerun.

    pip install rerun-sdk==0.41.0 trimesh numpy
    prehend export grasps.parquet --top 10 --format json --out exported
    python examples/python/show_in_rerun.py exported/schunk_sdh_coffee_mug.json [--mesh FILE] [--save grasps.rrd]

Run where the table's mesh path leads to the mesh. It is drawn as its file has it; where a NAME.toml beside it scales or
turns it, give the scaled mesh with --mesh. With --save, a recording is written and no window opens.
"""

import argparse
import json

import numpy as np
import rerun as rr
import trimesh

arguments = argparse.ArgumentParser()
arguments.add_argument("grasps")
arguments.add_argument("--mesh")
arguments.add_argument("--save")
arguments = arguments.parse_args()
file = json.load(open(arguments.grasps))
mesh = trimesh.load(arguments.mesh or file["mesh"], force="mesh")
rr.init("prehend", spawn=arguments.save is None)
if arguments.save:
    rr.save(arguments.save)
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
    # The squeeze's forces on the object, 1 mm a newton; none where the contacts cannot balance.
    forces = np.array([f["force"] for f in grasp["squeeze"]["forces"] or []]).reshape(-1, 3)
    rr.log("squeeze", rr.Arrows3D(origins=points[: len(forces)], vectors=1e-3 * forces, colors=[255, 120, 0]))
    rr.log("epsilon", rr.Scalars(grasp["epsilon"]))
    rr.log("about", rr.TextLog(f"{grasp['grasp_id']}: epsilon {grasp['epsilon']:.3f}"))
