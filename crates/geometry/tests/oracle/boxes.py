"""Smallest boxes and hull volumes found by other programs, for tests/boxes.rs.

    pip install numpy==2.4.6 scipy==1.17.1 trimesh==5.2.0 open3d==0.20.0 pillow
    python boxes.py shapes   > boxes.json           # generated clouds: points, qhull's volume, least volumes
    python boxes.py objects FOLDER … > box_objects.json   # mesh files below folders: least volumes

The least volume known is the minimum over
- trimesh `bounding_box_oriented` (facet normals with calipers),
- Open3D MINIMAL_APPROX (facet normals) and MINIMAL_JYLANKI (Jylänki's edge triples),
- `edges`: every pair of hull edges flush with adjacent faces (O'Rourke's condition), swept along the one parameter that
  is left and refined by golden section; hulls of up to 90 edges,
- `random`: 8,000 random rotations, the best 150 refined by shrinking random turns; all hulls.
"""

import json
import pathlib
import sys

import numpy as np
import open3d
import scipy
import trimesh
from scipy.spatial import ConvexHull

FLOAT = 5  # decimals of generated coordinates


def rotations(rng, n):
    q = rng.normal(size=(n, 4))
    return from_quaternions(q / np.linalg.norm(q, axis=1)[:, None])


def from_quaternions(q):
    w, x, y, z = q.T
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]
    return np.stack(rows, axis=1).reshape(-1, 3, 3)


def volumes(frames, points):
    """Box volumes for frames whose rows are the axes."""
    result = np.empty(len(frames))
    chunk = max(1, 4_000_000 // (3 * len(points)))
    for i in range(0, len(frames), chunk):
        local = frames[i:i + chunk] @ points.T
        result[i:i + chunk] = np.prod(local.max(axis=2) - local.min(axis=2), axis=1)
    return result


def random_search(points, rng, n_random=8000, n_kept=150, n_turns=24):
    frames = rotations(rng, n_random)
    size = volumes(frames, points)
    best = np.argsort(size)[:n_kept]
    frames, size = frames[best], size[best]
    scale = np.full(len(frames), 0.15)
    while scale.max() > 1e-8 and len(frames):
        turn = rng.normal(size=(len(frames), n_turns, 3)) * scale[:, None, None]
        q = np.concatenate([np.ones(turn.shape[:2] + (1,)), turn / 2], axis=2).reshape(-1, 4)
        tried = from_quaternions(q / np.linalg.norm(q, axis=1)[:, None]).reshape(len(frames), n_turns, 3, 3)
        tried = np.einsum("fij,fnkj->fnik", frames, tried)
        found = volumes(tried.reshape(-1, 3, 3), points).reshape(len(frames), n_turns)
        pick = found.argmin(axis=1)
        least = found[np.arange(len(frames)), pick]
        better = least < size
        frames[better] = tried[np.arange(len(frames)), pick][better]
        scale = np.where(better, scale * 1.1, scale * 0.6)
        size = np.minimum(size, least)
        if scale.max() < 1e-3 and len(frames) > 12:
            keep = np.argsort(size)[:12]
            frames, size, scale = frames[keep], size[keep], scale[keep]
    return size.min()


def hull_edges(hull, points):
    normals, edges = hull.equations[:, :3], {}
    for facet, corners in enumerate(hull.simplices):
        for k in range(3):
            edges.setdefault(tuple(sorted((corners[k - 1], corners[k]))), []).append(facet)
    return [(points[b] - points[a], normals[f], normals[g]) for (a, b), (f, g) in edges.items()
            if normals[f] @ normals[g] < 1 - 1e-12]


def edge_search(points, hull, n_samples=40):
    edges = hull_edges(hull, points)
    if len(edges) > 90:
        return None
    corners = points[hull.vertices]
    e = np.array([x[0] / np.linalg.norm(x[0]) for x in edges])
    f, g = (np.array([x[k] for x in edges]) for k in (1, 2))
    first, second = (m.ravel() for m in np.meshgrid(range(len(e)), range(len(e)), indexing="ij"))

    def frames_at(t, i, j):
        n = f[i] + t[:, None] * (g[i] - f[i])
        n /= np.linalg.norm(n, axis=1)[:, None]
        m = np.cross(n, e[j])
        length = np.linalg.norm(m, axis=1)
        flat = length < 1e-9
        m[flat] = np.cross(n[flat], e[i][flat])
        m /= np.linalg.norm(m, axis=1)[:, None]
        return np.stack([n, m, np.cross(n, m)], axis=1)

    ts = np.linspace(0, 1, n_samples)
    table = np.stack([volumes(frames_at(np.full(len(first), t), first, second), corners) for t in ts], axis=1)
    flat = np.argsort(table, axis=None)[:400]
    pair, k = np.unravel_index(flat, table.shape)
    i, j = first[pair], second[pair]
    low, high = np.clip(ts[k] - ts[1], 0, 1), np.clip(ts[k] + ts[1], 0, 1)
    ratio = (np.sqrt(5) - 1) / 2
    for _ in range(45):
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        left = volumes(frames_at(a, i, j), corners) < volumes(frames_at(b, i, j), corners)
        high, low = np.where(left, b, high), np.where(left, low, a)
    return min(table.min(), volumes(frames_at((low + high) / 2, i, j), corners).min())


def open3d_volume(points, method):
    tensor = open3d.core.Tensor(np.ascontiguousarray(points))
    found = open3d.t.geometry.OrientedBoundingBox.create_from_points(tensor, False, method)
    axes = found.rotation.numpy()
    if abs(np.linalg.det(axes)) < 0.99:
        return None
    # Measured again: what counts is the box around the points along these axes.
    return float(volumes(np.linalg.qr(axes)[0].T[None], points)[0])


def solve(points, seed):
    rng = np.random.default_rng(seed)
    hull = ConvexHull(points)
    corners = points[hull.vertices]
    methods = open3d.t.geometry.MethodOBBCreate
    found = {"trimesh": float(np.prod(trimesh.PointCloud(points).bounding_box_oriented.primitive.extents))}
    for name, method in [("open3d_approx", methods.MINIMAL_APPROX), ("open3d_jylanki", methods.MINIMAL_JYLANKI)]:
        try:
            found[name] = open3d_volume(corners, method)
        except RuntimeError:
            found[name] = None
    found["edges"] = edge_search(points, hull)
    n = 8000 if len(corners) < 200 else 3000
    found["random"] = float(random_search(corners, rng, n, 150 if len(corners) < 200 else 40))
    found = {k: None if v is None or not np.isfinite(v) else float(v) for k, v in found.items()}
    best = min(v for k, v in found.items() if v is not None and v >= hull.volume * (1 - 1e-12))
    return {"hull_volume": hull.volume, "n_corners": len(corners), "best": best, "solvers": found}


def ring(n, r, z, turn=0.0):
    a = np.arange(n) * 2 * np.pi / n + turn
    return np.stack([r * np.cos(a), r * np.sin(a), np.full(n, z)], axis=1)


def sphere(rng, n):
    p = rng.normal(size=(n, 3))
    return p / np.linalg.norm(p, axis=1)[:, None]


def shapes():
    rng = np.random.default_rng(20261122)
    cube = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    octahedron = np.concatenate([np.eye(3), -np.eye(3)])
    regular = cube[[0, 3, 5, 6]]
    yield "random cloud", [rng.uniform(-1, 1, (n, 3)) for n in (8, 15, 30, 60, 200)]
    yield "random cloud", [rng.normal(size=(n, 3)) * s for n, s in ((12, [1, 1, 1]), (50, [1, .5, .2]), (150, [1, 1, .3]))]
    yield "ball", [sphere(rng, n) for n in (10, 20, 40, 100, 150)]
    yield "cube", [cube, cube * [1, .6, .3], cube * [1, 1, .05]]
    yield "cube", [np.array(np.meshgrid(*[np.arange(4.0)] * 3)).reshape(3, -1).T]
    yield "regular tetrahedron", [regular, regular * 3]
    yield "irregular tetrahedron", [rng.uniform(-1, 1, (4, 3)) for _ in range(6)]
    yield "octahedron", [octahedron, octahedron * [1, .8, .5], octahedron * [1, 1, .4]]
    yield "cylinder", [np.concatenate([ring(n, 1, 0), ring(n, 1, h)]) for n, h in ((5, 1), (7, .3), (12, 3), (24, 2), (50, 1), (96, 8))]
    yield "frustum", [np.concatenate([ring(n, 1, 0), ring(n, r, h)]) for n, r, h in ((6, .5, 1), (9, .2, 2), (16, .7, .5), (32, .8, 2.5))]
    yield "needle", [rng.uniform(-1, 1, (n, 3)) * [1, s, s] for n, s in ((10, .01), (30, .01), (60, .001))]
    yield "plate", [rng.uniform(-1, 1, (n, 3)) * [1, .7, s] for n, s in ((10, .01), (40, .002), (12, .001))]
    handle = np.concatenate([[[1 + .6 * np.sin(a), y, 1.1 + .8 * np.cos(a)] for y in (-.15, .15)] for a in np.linspace(0, np.pi, 9)])
    yield "mug", [np.concatenate([ring(n, 1, 0), ring(n, r, 2.2), handle * [r, 1, 1]]) for n, r in ((12, 1), (24, 1), (32, 1.1), (48, .9))]
    yield "two balls", [np.concatenate([sphere(rng, n), sphere(rng, n) * r + [d, .2, 0]]) for n, r, d in ((10, 1, 2), (20, .4, 1.5), (40, .7, 3), (60, .3, 1))]
    yield "few corners", [rng.uniform(-1, 1, (n, 3)) for n in (5, 5, 6, 6, 7, 8)]
    yield "duplicates", [np.repeat(rng.uniform(-1, 1, (12, 3)), 3, axis=0), np.concatenate([cube, cube * .999, cube])]


def as_turned(rng, points):
    turned = points @ rotations(rng, 1)[0].T
    return np.round(turned, FLOAT)


def main():
    # Its warnings go to the standard output.
    open3d.utility.set_verbosity_level(open3d.utility.VerbosityLevel.Error)
    result = {"versions": {"python": sys.version.split()[0], "numpy": np.__version__, "scipy": scipy.__version__,
                           "trimesh": trimesh.__version__, "open3d": open3d.__version__}}
    if sys.argv[1] == "shapes":
        rng = np.random.default_rng(7)
        rows = []
        for family, clouds in shapes():
            for k, points in enumerate(clouds):
                points = as_turned(rng, points)
                row = {"family": family, "points": [float(x) for x in points.ravel()]}
                rows.append(row | solve(points, len(rows)))
                print(family, k, rows[-1]["solvers"], file=sys.stderr)
        result["shapes"] = rows
    else:
        rows = {}
        for folder in map(pathlib.Path, sys.argv[2:]):
            for path in sorted(p for p in folder.rglob("*") if p.suffix in (".ply", ".obj", ".off", ".stl")):
                mesh = trimesh.load(path, process=False, force="mesh")
                rows[path.name] = solve(np.asarray(mesh.vertices, float), 1)
                print(path.name, rows[path.name], file=sys.stderr)
        result["objects"] = rows
    json.dump(result, sys.stdout, separators=(",", ":"))
    print()


if __name__ == "__main__":
    main()
