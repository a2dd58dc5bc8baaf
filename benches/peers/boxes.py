"""Smallest boxes of other programs on the files of benches/boxes.rs, hull included, one thread, beside ours.

    pip install numpy==2.4.6 scipy==1.17.1 trimesh==5.2.0 open3d==0.20.0 pillow
    cargo bench -p prehend-benches --bench boxes
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python boxes.py --criterion target/criterion FOLDER …

A line for each object: best of three runs in milliseconds, and the volume; with `--criterion` also our median from the bench
that ran just before (`crates/geometry/tests/trimesh_oracle.rs` compares volumes). `--only trimesh` leaves Open3D out, which
then need not be installed.
"""

import argparse
import json
import pathlib
import time

import numpy as np
import trimesh


def by_trimesh(points):
    # A new object every time: trimesh keeps what it has computed.
    return float(np.prod(trimesh.PointCloud(points).bounding_box_oriented.primitive.extents))


def by_open3d(name):
    import open3d

    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    method = getattr(open3d.t.geometry.MethodOBBCreate, name)

    def solve(points):
        tensor = open3d.core.Tensor(points)
        return float(open3d.t.geometry.OrientedBoundingBox.create_from_points(tensor, False, method).volume())
    return solve


def solvers(only):
    if only == "trimesh":
        return {"trimesh": by_trimesh}
    return {"trimesh": by_trimesh, "open3d_approx": by_open3d("MINIMAL_APPROX"),
            "open3d_jylanki": by_open3d("MINIMAL_JYLANKI")}


def criterion_ms(folder, name):
    estimates = pathlib.Path(folder) / "minimum_volume_box" / name / "new" / "estimates.json"
    return json.loads(estimates.read_text())["median"]["point_estimate"] * 1e-6


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folders", nargs="+", type=pathlib.Path)
    parser.add_argument("--criterion")
    parser.add_argument("--only")
    options = parser.parse_args()
    chosen = solvers(options.only)
    times = {name: [] for name in [*chosen, *(["ours"] if options.criterion else [])]}
    for folder in options.folders:
        for path in sorted(p for p in folder.rglob("*") if p.suffix in (".ply", ".obj", ".off", ".stl")):
            points = np.ascontiguousarray(trimesh.load(path, process=False, force="mesh").vertices, float)
            line = [path.stem]
            for name, solve in chosen.items():
                best = np.inf
                for _ in range(3):
                    start = time.perf_counter()
                    try:
                        volume = solve(points)
                    except RuntimeError:
                        volume = float("nan")
                    best = min(best, time.perf_counter() - start)
                    if best > 0.3:
                        break
                times[name].append(1e3 * best)
                line.append(f"{name} {1e3 * best:.2f} ms {volume:.6e}")
            if options.criterion:
                times["ours"].append(criterion_ms(options.criterion, path.stem))
                line.append(f"ours {times['ours'][-1]:.2f} ms")
            print("; ".join(line), flush=True)
    for name, values in times.items():
        print(f"{name}: median {np.median(values):.2f} ms, worst {max(values):.2f} ms of {len(values)}")


if __name__ == "__main__":
    main()
