"""Exact distances from points to a bent bar's surface, for tests/distance.rs.

Every float is taken as the rational number that it is. The distance to a triangle is the least over its corners, the feet
on its edges' lines and the foot on its plane, where these lie within; the side follows from the two boxes that make up
the bar. All triangles are looked at.

Run with Python 3.11 (standard library only): python3 distances.py > distances.json
"""

import json
import random
from fractions import Fraction as F


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def along(a, d, t):
    return tuple(x + t * y for x, y in zip(a, d))


def squared_distance(p, triangle):
    feet = list(triangle)
    for a, b in zip(triangle, triangle[1:] + triangle[:1]):
        d = sub(b, a)
        t = dot(sub(p, a), d) / dot(d, d)
        if 0 <= t <= 1:
            feet.append(along(a, d, t))
    a, b, c = triangle
    normal = cross(sub(b, a), sub(c, a))
    foot = along(p, normal, -dot(sub(p, a), normal) / dot(normal, normal))
    sides = [dot(cross(sub(v, u), sub(foot, u)), normal) for u, v in ((a, b), (b, c), (c, a))]
    if min(sides) >= 0:
        feet.append(foot)
    return min(dot(sub(p, q), sub(p, q)) for q in feet)


# An L of two boxes, [0, 4] x [0, 1] x [0, 1] and [0, 1] x [0, 3] x [0, 1], in units of 1/64 m.
OUTLINE = [(0, 0), (4, 0), (4, 1), (1, 1), (1, 3), (0, 3)]
CAPS = [(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)]


def mesh():
    n = len(OUTLINE)
    vertices = [[x / 64, y / 64, z / 64] for z in (0, 1) for x, y in OUTLINE]
    triangles = [[a + n, b + n, c + n] for a, b, c in CAPS] + [[a, c, b] for a, b, c in CAPS]
    for i in range(n):
        j = (i + 1) % n
        triangles += [[i, j, j + n], [i, j + n, i + n]]
    return vertices, triangles


def is_inside(p):
    x, y, z = (v * 64 for v in p)
    return 0 < z < 1 and ((0 < x < 4 and 0 < y < 1) or (0 < x < 1 and 0 < y < 3))


def main():
    rng = random.Random(64)
    vertices, triangles = mesh()
    corners = [[tuple(map(F, vertices[i])) for i in t] for t in triangles]
    points = []
    for k in range(300):
        p = [rng.uniform(-1, 5) / 64, rng.uniform(-1, 4) / 64, rng.uniform(-1, 2) / 64]
        if k % 3 == 0:
            p = [rng.uniform(0, 1.2) / 64, rng.uniform(0, 3) / 64, rng.uniform(0, 1) / 64]
        exact = tuple(map(F, p))
        distance = float(min(squared_distance(exact, t) for t in corners)) ** 0.5
        points.append({"point": p, "distance": -distance if is_inside(exact) else distance})
    print(json.dumps({"vertices": vertices, "triangles": triangles}).rstrip("}") + ', "points": [')
    print(",\n".join(json.dumps(p) for p in points) + "]}")


if __name__ == "__main__":
    main()
