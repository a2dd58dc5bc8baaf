"""Times of other programs' smallest boxes on the files of benches/boxes.rs, hull included, one thread.

    pip install numpy==2.4.6 scipy==1.17.1 trimesh==5.2.0 open3d==0.20.0 pillow
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python boxes.py FOLDER …

Prints a line for each object: best of three runs in milliseconds, and the volume. The number of runs grows for short ones.
"""

import pathlib
import sys
import time

import numpy as np
import open3d
import trimesh

open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
METHODS = open3d.t.geometry.MethodOBBCreate


def by_trimesh(points):
    # A new object every time: trimesh keeps what it has computed.
    return float(np.prod(trimesh.PointCloud(points).bounding_box_oriented.primitive.extents))


def by_open3d(method):
    def solve(points):
        tensor = open3d.core.Tensor(points)
        return float(open3d.t.geometry.OrientedBoundingBox.create_from_points(tensor, False, method).volume())
    return solve


SOLVERS = {
    "trimesh": by_trimesh,
    "open3d_approx": by_open3d(METHODS.MINIMAL_APPROX),
    "open3d_jylanki": by_open3d(METHODS.MINIMAL_JYLANKI),
}


def main():
    times = {name: [] for name in SOLVERS}
    for folder in map(pathlib.Path, sys.argv[1:]):
        for path in sorted(p for p in folder.rglob("*") if p.suffix in (".ply", ".obj", ".off", ".stl")):
            points = np.ascontiguousarray(trimesh.load(path, process=False, force="mesh").vertices, float)
            line = [path.stem]
            for name, solve in SOLVERS.items():
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
            print("; ".join(line), flush=True)
    for name, values in times.items():
        print(f"{name}: median {np.median(values):.2f} ms, worst {max(values):.2f} ms of {len(values)}")


if __name__ == "__main__":
    main()
