"""Writes hulls.json: epsilon, volume, origin distance, rank and task scale of grasps, by SciPy (Qhull, NNLS, HiGHS).

    pip install scipy numpy
    python3 hulls.py > hulls.json

Nothing here shares code with the crate: wrenches are built from the definition in docs/conventions.md, hulls by Qhull,
distances by non-negative least squares, task scales by linear programs. Contacts are [point, normal, mu, torsion], rounded
where they are random; normals are not of unit length. Sets whose hull Qhull refuses (flat ones) have epsilon 0 by definition.
"""

import itertools
import json

import numpy as np
import scipy
from scipy.optimize import linprog, nnls
from scipy.spatial import ConvexHull, QhullError

rng = np.random.default_rng(20100)


def wrenches(contact, center, scale, edges, unit_name, gravity):
    p, n, mu, torsion = np.array(contact[0:3]), unit(contact[3:6]), contact[6], contact[7]
    helper = np.array([0.0, 0.0, 1.0]) if abs(n[0]) > 1 - 1e-9 else np.array([1.0, 0.0, 0.0])
    t1 = np.cross(n, helper)
    t1 /= np.linalg.norm(t1)
    t2 = np.cross(n, t1)
    mm = 1000.0 if unit_name == "m" else 1.0
    e = torsion * mm
    samples = []
    if e > 0:
        for latitude, count in ((90, 1), (45, 5), (0, 8), (-45, 5), (-90, 1)):
            phi = np.radians(latitude)
            for k in range(count):
                theta = 2 * np.pi * k / count
                d = np.array([np.cos(theta) * np.cos(phi), np.sin(theta) * np.cos(phi), np.sin(phi)])
                s = 1 / np.sqrt(d[0] ** 2 + d[1] ** 2 + (d[2] / e) ** 2)
                samples.append(s * d * np.array([1, 1, 1 / mm]))
    else:
        for k in range(edges):
            theta = 2 * np.pi * k / edges
            samples.append(np.array([np.cos(theta), np.sin(theta), 0.0]))
    out = []
    for x, y, t in samples:
        f = n + mu * (x * t1 + y * t2)
        tau = (np.cross(p - center, f) + mu * t * n) / scale
        out.append(np.concatenate([f + gravity, tau]))
    return np.array(out)


def points_of(case):
    """Points whose hull is the space, and all wrenches: divided by the metric's semi-axes, over the axes that count."""
    axes = [k for k, letter in enumerate(case["axes"]) if letter == "x"]
    weights = np.array(case["semi_axes"])
    groups = [
        (wrenches(c, np.array(case["center"]), case["torque_scale"], case["cone_edges"], case["length_unit"], np.array(case["gravity"])) / weights)[:, axes]
        for c in case["contacts"]
    ]
    if case["norm"] == "l1":
        return np.vstack(groups), np.vstack(groups)
    # Minkowski sum of {0} and each contact's wrenches, pruned to hull vertices by Qhull later.
    total = np.zeros((1, len(axes)))
    for g in groups:
        total = (total[:, None, :] + np.vstack([np.zeros(len(axes)), g])[None, :, :]).reshape(-1, len(axes))
    return np.unique(total.round(14), axis=0), np.vstack(groups)


def distance(points):
    """Least |sum w_i p_i| over convex weights: NNLS with the sum held at 1 by a heavy row, then polished."""
    a = np.vstack([points.T, np.full(len(points), 1e4)])
    b = np.concatenate([np.zeros(points.shape[1]), [1e4]])
    w, _ = nnls(a, b, maxiter=10000)
    support = np.flatnonzero(w > 1e-12)
    # Exact least norm on the affine hull of the supporting points.
    s = points[support]
    base, edges = s[0], (s[1:] - s[0]).T
    x = base - (edges @ np.linalg.lstsq(edges, base, rcond=None)[0] if len(support) > 1 else 0)
    return float(np.linalg.norm(x))


def hull_options(points):
    for options in ("Qt Qx", "Qt Q12", "QJ1e-13"):
        try:
            return ConvexHull(points, qhull_options=options)
        except QhullError:
            continue
    return None


def task_scale(case):
    """Largest s with -s t in the hull of the wrenches and 0, least over the task: one linear program each."""
    _, raw = points_of(case)
    best = np.inf
    for t in case["task"]:
        a_eq = np.hstack([raw.T, np.array(t)[:, None]])
        cost = np.zeros(len(raw) + 1)
        cost[-1] = -1.0
        bound = np.append(np.ones(len(raw)), 0.0)[None, :]
        found = linprog(cost, A_ub=bound, b_ub=[1.0], A_eq=a_eq, b_eq=np.zeros(6), method="highs")
        best = min(best, -found.fun)
    return float(best)


def solve(case):
    points, raw = points_of(case)
    n_axes = points.shape[1]
    scaled = raw.copy()
    if n_axes == 6:
        scaled[:, 3:] /= max(np.linalg.norm(scaled[:, 3:], axis=1).max(), 1e-12)
    case["rank"] = int(np.linalg.matrix_rank(scaled, tol=1e-10 * np.linalg.norm(scaled, 2)))
    largest = np.linalg.norm(raw, axis=1).max()
    affine = np.linalg.matrix_rank(points - points.mean(axis=0), tol=1e-10 * largest)
    hull = hull_options(points) if affine == n_axes else None
    case["volume"] = float(hull.volume) if hull is not None else 0.0
    eps = float((-hull.equations[:, -1]).min()) if hull is not None else 0.0
    case["epsilon"] = eps if eps > 1e-9 * largest else 0.0
    case["force_closure"] = case["epsilon"] > 0.0
    if case["task"]:
        case["task_scale"] = task_scale(case)
    case["origin_distance"] = 0.0 if case["norm"] == "linf" or case["force_closure"] else distance(points)
    return case


def unit(v):
    v = np.asarray(v, dtype=float)
    return v / np.linalg.norm(v)


def contact(p, n, mu, torsion=0.0, exact=True):
    n = np.asarray(n, dtype=float)
    n = n / np.abs(n).max()
    p = np.asarray(p, dtype=float)
    if not exact:
        p, n = p.round(5), n.round(4)
    return [float(x) for x in p] + [float(x) for x in n] + [float(mu), torsion]


def case(name, contacts, center=(0, 0, 0), scale=0.1, edges=8, norm="l1", unit_name="m", axes="xxxxxx", semi_axes=(1,) * 6, gravity=(0, 0, 0), task=()):
    digits = 12 if "random" not in name else 5
    return {
        "name": name,
        "center": [round(float(x), digits) for x in center],
        "torque_scale": round(float(scale), digits),
        "cone_edges": edges,
        "norm": norm,
        "length_unit": unit_name,
        "axes": axes,
        "semi_axes": [float(x) for x in semi_axes],
        "gravity": [float(x) for x in gravity],
        "task": [[float(x) for x in t] for t in task],
        "contacts": contacts,
    }


def on_ellipsoid(n, mu, torsion=0.0):
    axes = rng.uniform(0.02, 0.1, 3)
    out = []
    for _ in range(n):
        d = unit(rng.normal(size=3))
        p = d * axes
        out.append(contact(p, -p / axes**2, mu, torsion, exact=False))
    return out, axes.max()


def on_box(n, mu, torsion=0.0):
    half = rng.choice([0.01, 0.02, 0.03, 0.05, 0.1], 3)
    out = []
    for _ in range(n):
        axis, sign = rng.integers(3), rng.choice([-1, 1])
        p = rng.uniform(-1, 1, 3) * half
        p[axis] = sign * half[axis]
        normal = np.zeros(3)
        normal[axis] = -sign
        out.append(contact(p, normal, mu, torsion, exact=False))
    return out, float(np.linalg.norm(half))


cases = []
for i in range(300):
    n, mu = int(rng.integers(1, 9)), float(rng.choice([0.2, 0.3, 0.5, 1.0, 2.0]))
    torsion = float(rng.choice([0.0, 0.0, 1.5e-3, 2.13e-3]))
    make = on_ellipsoid if i % 2 else on_box
    contacts, scale = make(n, mu, torsion)
    cases.append(case(f"random {i}", contacts, rng.normal(0, 0.005, 3), scale, int(rng.choice([3, 4, 5, 8, 12]))))
for i in range(20):  # soft and point contacts mixed, in millimetres
    soft, scale = on_ellipsoid(int(rng.integers(1, 4)), 1.0, 2.0)
    hard, _ = on_ellipsoid(int(rng.integers(1, 5)), 0.3)
    for c in soft + hard:
        c[0:3] = [round(x * 1000, 3) for x in c[0:3]]
    cases.append(case(f"millimetres {i}", soft + hard, scale=scale * 1000, unit_name="mm"))
for i in range(25):
    contacts, scale = (on_ellipsoid if i % 2 else on_box)(int(rng.integers(2, 5)), 0.8)
    cases.append(case(f"linf {i}", contacts, scale=scale, edges=int(rng.choice([3, 4])), norm="linf"))
for i in range(40):  # masks of 2 to 5 axes
    n_axes = 2 + i % 4
    axes = "".join(rng.permutation(list("x" * n_axes + "." * (6 - n_axes))))
    contacts, scale = (on_ellipsoid if i % 2 else on_box)(int(rng.integers(1, 7)), 0.5)
    cases.append(case(f"random mask {i}", contacts, scale=scale, axes=axes, edges=int(rng.choice([4, 8]))))
for i in range(40):  # metrics and gravity
    contacts, scale = (on_ellipsoid if i % 2 else on_box)(int(rng.integers(2, 7)), 0.7, 2e-3 if i % 3 == 0 else 0.0)
    cases.append(case(f"random metric {i}", contacts, scale=scale, semi_axes=rng.choice([0.25, 0.5, 1, 2, 3], 6), gravity=(rng.normal(size=3) * 0.2).round(3)))
for i in range(40):  # task sets
    contacts, scale = (on_ellipsoid if i % 2 else on_box)(int(rng.integers(2, 8)), 0.7, 2e-3 if i % 3 == 0 else 0.0)
    cases.append(case(f"random task {i}", contacts, scale=scale, task=rng.normal(size=(int(rng.integers(1, 6)), 6)).round(2)))

# Degenerate and symmetric sets.
corners = [np.array(s) * 0.05 for s in itertools.product([-1, 1], repeat=3)]
faces = [(a, s) for a in range(3) for s in (-1, 1)]


def face_contact(axis, sign, u=0.0, v=0.0, mu=0.5, torsion=0.0, half=0.05):
    p = np.zeros(3)
    p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3] = sign * half, u, v
    n = np.zeros(3)
    n[axis] = -sign
    return contact(p, n, mu, torsion)


for mu in (0.0, 0.1, 0.5, 1.0, 2.0):
    cases.append(case(f"cube face centres mu {mu}", [face_contact(a, s, mu=mu) for a, s in faces], scale=0.0866))
    cases.append(case(f"antipodal points mu {mu}", [face_contact(0, 1, mu=mu), face_contact(0, -1, mu=mu)], scale=0.05))
    cases.append(
        case(f"antipodal soft mu {mu}", [face_contact(0, 1, mu=mu, torsion=2.13e-3), face_contact(0, -1, mu=mu, torsion=2.13e-3)], scale=0.05)
    )
    cases.append(case(f"one contact mu {mu}", [face_contact(2, 1, mu=mu)], scale=0.05))
    cases.append(case(f"doubled contacts mu {mu}", [face_contact(a, s, 0.01, 0.02, mu) for a, s in faces] * 2, scale=0.0866))
    cases.append(case(f"cube corners mu {mu}", [contact(p, -p, mu) for p in corners], scale=0.0866))
    tetrahedron = [np.array(p) * 0.05 for p in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))]
    cases.append(case(f"tetrahedron mu {mu}", [contact(p, -p, mu) for p in tetrahedron], scale=0.0866))
    cases.append(case(f"same side mu {mu}", [face_contact(0, 1, u, v, mu) for u in (-0.03, 0.03) for v in (-0.03, 0.03)], scale=0.0866))
    ring = [np.array([np.cos(a), np.sin(a), 0]) * 0.04 for a in 2 * np.pi * np.arange(3) / 3]
    cases.append(case(f"three round a ball mu {mu}", [contact(p, -p, mu) for p in ring], scale=0.04))
    cases.append(case(f"opposite normals one point mu {mu}", [contact((0.05, 0, 0), (1, 0, 0), mu), contact((0.05, 0, 0), (-1, 0, 0), mu)], scale=0.05))
    cases.append(case(f"center far away mu {mu}", [face_contact(a, s, 0.01, 0.0, mu) for a, s in faces], center=(3, 4, 5), scale=7.0))
pinches = [face_contact(0, s, u, v, 0.5) for s in (-1, 1) for u in (-0.04, 0.04) for v in (-0.02, 0.02)]
for edges in (3, 4, 8, 16):
    cases.append(case(f"flat pinches {edges} edges", pinches, scale=0.0866, edges=edges))
# Twelve frictionless contacts on a cube's faces, two a face, off centre: the classic minimal restraint plus more.
restraint = [face_contact(a, s, s * u, -s * u * (a + 1), 0.0) for a, s in faces for u in (0.01, -0.015)]
cases.append(case("frictionless restraint", restraint, scale=0.0866))

out = [solve(c) for c in cases]
print(json.dumps({"made_by": f"scipy {scipy.__version__}, numpy {np.__version__}, hulls.py", "cases": out}, separators=(",", ":")))
