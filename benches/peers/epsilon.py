"""Times SciPy's Qhull (`Qt Qx`, its default exact hull) on the inputs of the bench `epsilon`, and compares ε.

    cargo bench -p prehend-benches --bench epsilon && python3 benches/peers/epsilon.py

Needs NumPy and SciPy: `python3 -m pip install numpy scipy==1.17.1` (the baseline's version). One thread; a set's time is the
least of three hulls. The first argument is the file of inputs, the second: only every so many-th set of a kind is timed.
"""

import json
import statistics
import sys
import time
from pathlib import Path

import numpy as np
import scipy
from scipy.spatial import ConvexHull, QhullError

default = Path(__file__).resolve().parents[2] / "target" / "epsilon-inputs.jsonl"
path = Path(sys.argv[1]) if len(sys.argv) > 1 else default
# Every how many sets of a kind one is timed: Qhull takes long.
every = int(sys.argv[2]) if len(sys.argv) > 2 else 1

groups = {}
for line in path.open():
    case = json.loads(line)
    groups.setdefault((case["kind"], case["contacts"], case["edges"]), []).append(case)

print(f"scipy {scipy.__version__}")
print(f"{'sets':22} {'timed':>6} {'refused':>8} {'median us':>12} {'mean us':>12} {'largest difference of epsilon':>32}")
for (kind, contacts, edges), cases in groups.items():
    times, refused, worst = [], 0, 0.0
    for case in cases[::every]:
        points = np.array(case["wrenches"])
        best = float("inf")
        try:
            for _ in range(3):
                begin = time.perf_counter()
                hull = ConvexHull(points, qhull_options="Qt Qx")
                best = min(best, time.perf_counter() - begin)
        except QhullError:
            refused += 1
            continue
        times.append(1e6 * best)
        worst = max(worst, abs(-hull.equations[:, -1].max() - case["epsilon"]))
    name = f"{kind} {contacts}x{edges}"
    if times:
        print(f"{name:22} {len(times):6} {refused:8} {statistics.median(times):12.0f} {statistics.mean(times):12.0f} {worst:32.1e}")
