"""Boxes of prehend beside CoACD with a smallest box around each of its parts.

    python decomposition.py parts FOLDER THRESHOLD MESH...   # runs CoACD, keeps its parts and times
    python decomposition.py table FOLDER PREHEND MESH...     # fits the boxes and compares

Needs coacd 1.0.14, trimesh 5.2.0, numpy 2.4. CoACD runs with its defaults but for the threshold, on one thread
(OMP_NUM_THREADS=1). Times are processor seconds of the decomposition alone for CoACD, of the whole process (start,
reading and writing included) for prehend. Both get the same boxes: those of `prehend mesh` around the corners of each
CoACD part; volumes are sums over boxes.
"""

import json
import pathlib
import resource
import subprocess
import sys

import numpy as np


def stem(mesh, threshold=None):
    path = pathlib.Path(mesh)
    return f"{path.parent.name}-{path.stem}" + (f"-{threshold}" if threshold else "")


def parts(folder, threshold, meshes):
    import coacd
    import trimesh

    coacd.set_log_level("error")
    for mesh in meshes:
        out = pathlib.Path(folder) / f"{stem(mesh, threshold)}.json"
        if out.exists():
            continue
        body = trimesh.load(mesh, force="mesh", process=True)
        if body.is_empty:
            raise SystemExit(f"{mesh}: no triangles")
        before = resource.getrusage(resource.RUSAGE_SELF).ru_utime
        found = coacd.run_coacd(coacd.Mesh(body.vertices, body.faces), threshold=float(threshold))
        seconds = resource.getrusage(resource.RUSAGE_SELF).ru_utime - before
        record = {"mesh": stem(mesh), "threshold": float(threshold), "seconds": seconds}
        record["triangles"] = len(body.faces)
        record["parts"] = [np.asarray(v).tolist() for v, _ in found]
        out.write_text(json.dumps(record))
        print(stem(mesh, threshold), len(found), f"{seconds:.1f} s", flush=True)


def run(command, text=None):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    answer = subprocess.run(command, input=text, capture_output=True, text=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return [json.loads(line) for line in answer.stdout.splitlines()], spent


def table(folder, prehend, meshes):
    import tempfile

    import trimesh

    print("| object | triangles | boxes | CoACD | prehend | CoACD s | prehend s |")
    print("|---|---|---|---|---|---|---|")
    smaller = quick = compared = 0
    for mesh in meshes:
        for path in sorted(pathlib.Path(folder).glob(f"{stem(mesh)}-0*.json")):
            record = json.loads(path.read_text())
            n = len(record["parts"])
            with tempfile.TemporaryDirectory() as parts_folder:
                files = []
                for i, points in enumerate(record["parts"]):
                    files.append(f"{parts_folder}/{i}.xyz")
                    np.savetxt(files[-1], points, fmt="%.17g")
                boxes, _ = run([prehend, "mesh", "--json", *files])
            theirs = sum(b["bounding_box"]["volume"] for b in boxes)
            ours, seconds = run([prehend, "decompose", "--as-is", "--boxes", str(n), "--json", mesh])
            total = sum(b["volume"] for b in ours[0]["boxes"])
            root = ours[0]["root"]["volume"]
            compared += 1
            smaller += total < theirs
            quick += seconds < record["seconds"] / 10
            print(
                f"| {stem(mesh)} | {record['triangles']} | {n} | {theirs / root:.3f} | {total / root:.3f} "
                f"| {record['seconds']:.2f} | {seconds:.2f} |"
            )
    print(f"smaller total on {smaller} of {compared}, under a tenth of the time on {quick}")


if __name__ == "__main__":
    if sys.argv[1] == "parts":
        parts(sys.argv[2], sys.argv[3], sys.argv[4:])
    else:
        table(sys.argv[2], sys.argv[3], sys.argv[4:])
