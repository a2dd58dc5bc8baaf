"""Exact volumes that tetrahedra and boxes share, for tests/shared_volumes.rs.

Every float is taken as the rational number that it is. A shared body is a list of half-spaces; its corners are the
meeting points of three planes that no other plane cuts off, its volume the sum of cones from one corner over all
faces. Unions follow by inclusion and exclusion. Nothing is split into tetrahedra, unlike in the program under test.

Run with Python 3.11 (standard library only): python3 shared_volumes.py > shared_volumes.json
"""

import copy
import itertools
import json
import random
from fractions import Fraction as F


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def det(a, b, c):
    return dot(a, cross(b, c))


def exact(values):
    return tuple(F(v) for v in values)


def half_spaces_of_box(box):
    """Pairs (n, d) with n . p <= d."""
    center, planes = exact(box["center"]), []
    for axis, extent in zip(box["axes"], box["extents"]):
        axis = exact(axis)
        for sign in (1, -1):
            normal = tuple(sign * x for x in axis)
            planes.append((normal, dot(normal, center) + F(extent) / 2))
    return planes


def half_spaces_of_tetrahedron(corners):
    points, planes = [exact(p) for p in corners], []
    for k in range(4):
        a, b, c = [points[i] for i in range(4) if i != k]
        normal = cross(sub(b, a), sub(c, a))
        side = dot(normal, sub(points[k], a))
        if side == 0:
            return None  # flat
        if side > 0:
            normal = tuple(-x for x in normal)
        planes.append((normal, dot(normal, a)))
    return planes


def hull_order(points, normal):
    """Corners of a convex polygon in order (Andrew's chain on the two axes that the normal leans on least)."""
    drop = max(range(3), key=lambda k: abs(normal[k]))
    u, v = [k for k in range(3) if k != drop]
    points = sorted(set(points), key=lambda p: (p[u], p[v]))

    def chain(points):
        out = []
        for p in points:
            while len(out) > 1 and (out[-1][u] - out[-2][u]) * (p[v] - out[-2][v]) <= (out[-1][v] - out[-2][v]) * (
                p[u] - out[-2][u]
            ):
                out.pop()
            out.append(p)
        return out[:-1]

    return chain(points) + chain(points[::-1])


def volume(planes):
    corners = set()
    for (n1, d1), (n2, d2), (n3, d3) in itertools.combinations(planes, 3):
        scale = det(n1, n2, n3)
        if scale == 0:
            continue
        c23, c31, c12 = cross(n2, n3), cross(n3, n1), cross(n1, n2)
        p = tuple((d1 * c23[k] + d2 * c31[k] + d3 * c12[k]) / scale for k in range(3))
        if all(dot(n, p) <= d for n, d in planes):
            corners.add(p)
    if len(corners) < 4:
        return F(0)
    apex, faces, total = min(corners), set(), F(0)
    for normal, d in planes:
        face = frozenset(p for p in corners if dot(normal, p) == d)
        if len(face) < 3 or face in faces:
            continue
        faces.add(face)
        ring = hull_order(face, normal)
        for b, c in zip(ring[1:], ring[2:]):
            total += abs(det(sub(ring[0], apex), sub(b, apex), sub(c, apex))) / 6
    return total


def union(bodies, within):
    total = F(0)
    for n in range(1, len(bodies) + 1):
        for chosen in itertools.combinations(bodies, n):
            total += (-1) ** (n + 1) * volume(within + [plane for body in chosen for plane in body])
    return total


def rotation(rng):
    w, x, y, z = (rng.gauss(0, 1) for _ in range(4))
    n = (w * w + x * x + y * y + z * z) ** 0.5
    w, x, y, z = w / n, x / n, y / n, z / n
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ]


IDENTITY = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def random_box(rng, extents, spread=0.3, turned=True):
    return {
        "center": [rng.uniform(-spread, spread) for _ in range(3)],
        "axes": rotation(rng) if turned else IDENTITY,
        "extents": extents,
    }


def random_tetrahedron(rng, size=1.0):
    return [[rng.uniform(-size, size) for _ in range(3)] for _ in range(4)]


def moved(case, offset):
    case["tetrahedron"] = [[x + o for x, o in zip(p, offset)] for p in case["tetrahedron"]]
    for box in case["boxes"]:
        box["center"] = [x + o for x, o in zip(box["center"], offset)]
    return case


def cases():
    rng = random.Random(20100)
    unit = {"center": [0.5, 0.5, 0.5], "axes": IDENTITY, "extents": [1.0, 1.0, 1.0]}
    corner = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    yield "corner of the unit cube", corner, [unit]
    yield "corner, twice as long", [[2 * x for x in p] for p in corner], [unit]
    yield "corner, three times as long", [[3 * x for x in p] for p in corner], [unit]
    yield "face on face, outside", [[-x for x in corner[1]]] + corner[:1] + corner[2:], [unit]
    for k in range(10):
        yield f"random {k}", random_tetrahedron(rng), [random_box(rng, [rng.uniform(0.3, 1.5) for _ in range(3)])]
    for k in range(6):
        thin = [rng.uniform(0.5, 1.5), rng.uniform(0.5, 1.5), 1e-3]
        yield f"thin box {k}", random_tetrahedron(rng), [random_box(rng, thin)]
    for k in range(4):
        yield f"rod {k}", random_tetrahedron(rng), [random_box(rng, [1.0, 1.2e-3, 1e-3], 0.1)]
    for k in range(6):
        base = [rng.uniform(-0.5, 0.5) for _ in range(3)]
        along = [rng.gauss(0, 0.6) for _ in range(3)]
        needle = [base] + [
            [b + t * a + rng.gauss(0, 1e-3) for b, a in zip(base, along)] for t in (0.4, 0.8, 1.2)
        ]
        yield f"needle {k}", needle, [random_box(rng, [0.7, 0.8, 0.9])]
    for k in range(4):
        yield f"tetrahedron a thousand times larger {k}", random_tetrahedron(rng, 1000.0), [
            random_box(rng, [1.0, 1.5, 2.0], 1.0)
        ]
    for k in range(4):
        yield f"box a thousand times larger {k}", random_tetrahedron(rng), [
            random_box(rng, [1000.0, 800.0, 900.0], 400.0),
            {"center": [500.0, 0.1, 0.2], "axes": IDENTITY, "extents": [1000.0, 900.0, 800.0]},
        ]
    for k in range(5):
        offset = [rng.uniform(-1000, 1000) for _ in range(3)]
        box = random_box(rng, [rng.uniform(0.3, 1.5) for _ in range(3)])
        case = moved({"tetrahedron": random_tetrahedron(rng), "boxes": [box]}, offset)
        yield f"a thousand units away {k}", case["tetrahedron"], case["boxes"]
    for k in range(6):
        boxes = [random_box(rng, [rng.uniform(0.3, 1.2) for _ in range(3)], 0.5, k % 2 == 0) for _ in range(3)]
        yield f"three boxes {k}", random_tetrahedron(rng), boxes
    yield "the same box twice", random_tetrahedron(rng), [unit, unit]
    turned = random_box(rng, [1.0, 1.0, 1.0], 0.1)
    yield "a turned box twice", random_tetrahedron(rng), [turned, turned]
    halves = [dict(unit, center=[x, 0.5, 0.5], extents=[0.5, 1.0, 1.0]) for x in (0.25, 0.75)]
    yield "a cut box", random_tetrahedron(rng), halves
    yield from far_and_small(rng)
    yield from needles_and_plates(rng)
    yield from touching(unit, corner)
    nested = dict(unit, extents=[0.25, 0.5, 0.5])
    yield "a box in a box", [[-1.0, -1.0, -1.0], [3.0, 0.0, 0.1], [0.2, 3.0, 0.0], [0.0, 0.3, 3.0]], [nested, unit]


def scaled(case, factor):
    case["tetrahedron"] = [[x * factor for x in p] for p in case["tetrahedron"]]
    for box in case["boxes"]:
        box["center"] = [x * factor for x in box["center"]]
        box["extents"] = [x * factor for x in box["extents"]]
    return case


def far_and_small(rng):
    """Ordinary bodies at any place and scale."""
    for power in (3, 4, 5, 6):
        for k in range(3):
            offset = [rng.uniform(-1, 1) * 10**power for _ in range(3)]
            boxes = [random_box(rng, [rng.uniform(0.3, 1.5) for _ in range(3)]) for _ in range(2)]
            case = moved({"tetrahedron": random_tetrahedron(rng), "boxes": boxes}, offset)
            yield f"1e{power} units away {k}", case["tetrahedron"], case["boxes"]
    for power in (-6, -3, 3, 6):
        for k in range(3):
            boxes = [random_box(rng, [rng.uniform(0.3, 1.5) for _ in range(3)]) for _ in range(2)]
            case = scaled({"tetrahedron": random_tetrahedron(rng), "boxes": boxes}, 10.0**power)
            yield f"scaled by 1e{power} {k}", case["tetrahedron"], case["boxes"]
            case = moved(copy.deepcopy(case), [rng.uniform(-1, 1) * 1e3 * 10.0**power for _ in range(3)])
            yield f"scaled by 1e{power}, a thousand sizes away {k}", case["tetrahedron"], case["boxes"]


def needles_and_plates(rng):
    """Needles and plates, up to a millionth as thick as long."""
    for power in (2, 3, 4, 5, 6):
        width = 10.0**-power
        for k in range(3):
            base, along = [[rng.uniform(-0.5, 0.5) for _ in range(3)] for _ in range(2)]
            needle = [base] + [
                [b + t * a + rng.gauss(0, width) for b, a in zip(base, along)] for t in (0.5, 1.0, 1.5)
            ]
            yield f"needle 1e-{power} {k}", needle, [random_box(rng, [0.4, 0.5, 0.6])]
            across = [rng.uniform(-0.5, 0.5) for _ in range(3)]
            plate = [
                [b + u * a + v * c + rng.gauss(0, width) for b, a, c in zip(base, along, across)]
                for u, v in ((0, 0), (1, 0.2), (0.1, 1), (1.2, 1.1))
            ]
            yield f"plate 1e-{power} {k}", plate, [random_box(rng, [0.4, 0.5, 0.6])]
            yield f"sheet 1e-{power} {k}", random_tetrahedron(rng), [random_box(rng, [1.0, 0.9, width])]
            yield f"stick 1e-{power} {k}", random_tetrahedron(rng), [random_box(rng, [1.0, width, width], 0.1)]
            yield f"plate 1e-{power} in a sheet {k}", plate, [random_box(rng, [1.0, 0.9, width], 0.1)]
            far = [rng.uniform(-1, 1) * 1e3 for _ in range(3)]
            case = moved({"tetrahedron": needle, "boxes": [random_box(rng, [0.4, 0.5, 0.6])]}, far)
            yield f"needle 1e-{power}, a thousand units away {k}", case["tetrahedron"], case["boxes"]


def touching(unit, corner):
    """Bodies whose faces, edges or corners meet, and one inside the other."""

    def shifted(dx, dy, dz, factor=1.0):
        return [[factor * x + d for x, d in zip(p, (dx, dy, dz))] for p in corner]

    yield "inside, apart", shifted(0.25, 0.25, 0.25, 0.25), [unit]
    yield "inside, on three faces", shifted(0, 0, 0, 0.5), [unit]
    yield "inside, on one face", shifted(0.25, 0.25, 0, 0.5), [unit]
    yield "around, apart", shifted(-1, -1, -1, 8.0), [unit]
    yield "around, on three faces", shifted(0, 0, 0, 3.0), [unit]
    yield "around, a corner on the slope", shifted(0, 0, 0, 3.0), [dict(unit, center=[0.75] * 3, extents=[0.5] * 3)]
    yield "outside, on a face", shifted(0.25, 0.25, 1.0, 0.5), [unit]
    yield "outside, on an edge", shifted(1.0, 1.0, 0.0), [unit]
    yield "outside, on a corner", shifted(1.0, 1.0, 1.0), [unit]
    yield "a corner on a face, from outside", [[0.5, 0.5, 1.0], [0.2, 0.1, 2.0], [0.9, 0.3, 2.0], [0.5, 0.9, 2.5]], [unit]
    yield "a corner on a face, from inside", [[0.5, 0.5, 1.0], [0.2, 0.1, 0.2], [0.9, 0.3, 0.1], [0.5, 0.9, 0.3]], [unit]
    yield "a corner on a face, through", [[0.5, 0.5, 0.0], [0.2, 0.1, 2.0], [0.9, 0.3, 2.0], [0.5, 0.9, 2.5]], [unit]
    yield "a corner on an edge", [[0.0, 0.5, 0.0], [1.5, 0.1, 0.2], [0.9, 1.3, 0.1], [0.5, 0.4, 1.3]], [unit]
    yield "an edge along an edge", [[0.0, 0.0, 0.25], [0.0, 0.0, 0.75], [1.5, 0.0, 0.5], [0.0, 1.5, 0.5]], [unit]
    yield "a face in the ceiling, from below", [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 2.0, 1.0], [0.3, 0.3, -0.5]], [unit]
    yield "a face in the ceiling, from above", [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [0.0, 2.0, 1.0], [0.3, 0.3, 2.5]], [unit]
    yield "corners of the cube", [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]], [unit]


def length(v):
    return float(dot(v, v)) ** 0.5


def slenderness(tetrahedron, boxes):
    """The larger of longest edge over least height, and longest over shortest extent of a box."""
    points = [exact(p) for p in tetrahedron]
    edges = [length(sub(p, q)) for p, q in itertools.combinations(points, 2)]
    areas = [length(cross(sub(q, p), sub(r, p))) for p, q, r in itertools.combinations(points, 3)]
    height = float(abs(det(*[sub(p, points[0]) for p in points[1:]]))) / max(areas)
    return max([max(edges) / height] + [max(b["extents"]) / min(b["extents"]) for b in boxes])


def main():
    out = []
    for name, tetrahedron, boxes in cases():
        around = half_spaces_of_tetrahedron(tetrahedron)
        bodies = [half_spaces_of_box(box) for box in boxes]
        out.append(
            {
                "name": name,
                "tetrahedron": tetrahedron,
                "boxes": boxes,
                "slenderness": slenderness(tetrahedron, boxes),
                "shared": [float(volume(around + body)) for body in bodies],
                "union": float(union(bodies, around)),
                "union_of_boxes": float(union(bodies, [])),
            }
        )
    print("[" + ",\n".join(json.dumps(case) for case in out) + "]")


if __name__ == "__main__":
    main()
