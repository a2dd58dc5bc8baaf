"""Tries of every hand on every object: share kept, tries a second, mean ε, contacts a grasp, main reasons of rejection.

    python hands_objects.py PREHEND 500 HAND[,HAND…] OBJECT[,OBJECT…] > table.txt

A HAND is a folder with hand.toml, or a .urdf: then what `prehend hand init` writes is taken, with no edit.
"""

import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

exe, tries, hands, objects = sys.argv[1], sys.argv[2], sys.argv[3].split(","), sys.argv[4].split(",")
root = pathlib.Path(tempfile.mkdtemp())


def prehend(*arguments):
    out = subprocess.run([exe, *arguments, "--json"], capture_output=True, text=True)
    return json.loads(out.stdout) if out.returncode == 0 else {"error": out.stderr.strip()[-200:]}


print("hand object triangles kept% tries/s epsilon contacts reasons", flush=True)
for hand in hands:
    name = pathlib.Path(hand).stem
    if hand.endswith(".urdf"):
        folder = str(root / name)
        prehend("hand", "init", hand, "--out", folder)
    else:
        folder = hand
    for mesh in objects:
        rows = root / "grasps.jsonl"
        rows.unlink(missing_ok=True)
        made = prehend("synthesize", "--hand", folder, "--object", mesh, "--tries", tries, "--seed", "1", "--out", str(rows))
        if "error" in made:
            print(name, pathlib.Path(mesh).stem, made["error"].replace("\n", " "), flush=True)
            continue
        grasps = [json.loads(line) for line in rows.read_text().splitlines()] if rows.exists() else []
        contacts = [c if isinstance(c, list) else json.loads(c) for c in (g["contacts"] for g in grasps)]
        mean = lambda values: statistics.fmean(values) if values else 0.0
        reasons = sorted(made["rejected"].items(), key=lambda r: -r[1])[:3]
        triangles = prehend("mesh", mesh).get("triangles", 0)
        print(
            name,
            pathlib.Path(mesh).stem,
            triangles,
            f"{100 * made['kept'] / max(made['tried'], 1):.1f}",
            f"{made['tries_per_second']:.0f}",
            f"{mean([g['qeps'] for g in grasps]):.3f}",
            f"{mean([len(c) for c in contacts]):.1f}",
            ", ".join(f"{r} {100 * n / max(made['tried'], 1):.0f} %" for r, n in reasons),
            flush=True,
        )
