"""Compares the poses of all links with yourdfpy's on N random postures of each hand.

    pip install yourdfpy==0.0.60
    python link_poses.py PREHEND 1000 HAND.urdf…
"""

import json
import subprocess
import sys
import tempfile

import numpy as np
import yourdfpy

exe, n = sys.argv[1], int(sys.argv[2])
rng = np.random.default_rng(7)
for path in sys.argv[3:]:
    u = yourdfpy.URDF.load(path, load_meshes=False, build_scene_graph=True)
    free = [j for j in u.actuated_joints if j.mimic is None]
    poses, lines = [], []
    for _ in range(n):
        q = {j.name: float(rng.uniform(j.limit.lower, j.limit.upper)) for j in free}
        lines.append(json.dumps(q))
    with tempfile.NamedTemporaryFile("w", suffix=".jsonl") as f:
        f.write("\n".join(lines))
        f.flush()
        out = subprocess.run([exe, "hand", path, "--postures", f.name, "--json"], capture_output=True, text=True)
    rows = [json.loads(l) for l in out.stdout.splitlines()]
    assert len(rows) == n, (len(rows), out.stderr[:300])
    worst = 0.0
    for line, row in zip(lines, rows):
        u.update_cfg(json.loads(line))
        for link, p in row["poses"].items():
            m = np.asarray(u.get_transform(link, u.base_link))
            w, x, y, z = p["quaternion_wxyz"]
            turn = np.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
                ]
            )
            worst = max(worst, np.abs(m[:3, 3] - p["translation"]).max(), np.abs(m[:3, :3] - turn).max())
    print(f"{path.split('hands/')[-1]:45} {n} postures, {len(u.link_map)} links: largest difference {worst:.2e}", flush=True)
