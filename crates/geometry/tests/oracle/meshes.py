"""What trimesh finds of mesh files, for tests/trimesh_oracle.rs.

    pip install numpy==2.4.6 scipy==1.17.1 trimesh==5.2.0
    python meshes.py ../../../../objects ../../../../../shared/data/objects > meshes.json

`vertices` are those of the file, `merged` those left when equal positions are one (trimesh rounds to 1e-8); `watertight` and
`consistent` (winding), `volume` (signed), `area` are of the merged mesh, `hull` is the volume of the convex hull, `box` that of
`bounding_box_oriented`. All in the file's unit.
"""

import json
import pathlib
import platform
import sys

import numpy
import scipy
import trimesh


def facts(path):
    raw = trimesh.load(path, process=False, force="mesh")
    mesh = trimesh.Trimesh(raw.vertices, raw.faces, process=False)
    n_vertices = len(mesh.vertices)
    mesh.merge_vertices()
    return {
        "vertices": n_vertices,
        "triangles": len(mesh.faces),
        "merged": len(mesh.vertices),
        "watertight": bool(mesh.is_watertight),
        "consistent": bool(mesh.is_winding_consistent),
        "volume": float(mesh.volume),
        "area": float(mesh.area),
        "hull": float(mesh.convex_hull.volume),
        "box": float(numpy.prod(mesh.bounding_box_oriented.primitive.extents)),
    }


def main():
    versions = {"python": platform.python_version(), "numpy": numpy.__version__, "scipy": scipy.__version__,
                "trimesh": trimesh.__version__}
    rows = []
    for folder in map(pathlib.Path, sys.argv[1:]):
        for path in sorted(p for p in folder.rglob("*") if p.suffix in (".ply", ".obj", ".off", ".stl")):
            rows.append(f'"{path.name}":{json.dumps(facts(path))}')
    print('{"versions":' + json.dumps(versions) + ',"objects":{\n' + ",\n".join(rows) + "\n}}")


main()
