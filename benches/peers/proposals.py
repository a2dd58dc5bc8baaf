"""Suitable grasps for each second of processor's time: blind tries against tries drawn from P(A | task, object).

    python proposals.py PREHEND 400 MODELS HAND[,HAND…] OBJECT…

MODELS is the models/ folder of a pipeline run; of each hand the network task-action of experiment B's first fold is asked, which has
not seen the objects of that fold. Suitable: P(task | object, action, constraints) above one half. What reading costs is taken off. Blind
tries are ten times as many where they gave fewer than ten suitable grasps.
"""

import json
import os
import subprocess
import sys

exe, tries, models, hands, objects = sys.argv[1], int(sys.argv[2]), sys.argv[3], sys.argv[4].split(","), sys.argv[5:]


def plan(hand, mesh, task, n, *options):
    model = f"{models}/{hand.split('/')[-1]}/experiment-b-0/task-action.bin"
    arguments = ["plan", "--hand", hand, "--object", mesh, "--task", task, "--model", model, "--tries", str(n), "--top", "1"]
    before = os.times()
    out = subprocess.run([exe, *arguments, *options, "--json"], capture_output=True, text=True, check=True)
    after = os.times()
    answer = json.loads(out.stdout)
    return answer, after.children_user - before.children_user


for hand in hands:
    for mesh in objects:
        reading = plan(hand, mesh, "pouring", 1)[1]
        for task in ["hand-over", "pouring", "tool-use"]:
            line = []
            for options in [(), ("--proposals",)]:
                answer, seconds = plan(hand, mesh, task, tries, *options)
                if answer["suitable"] < 10 and not options:
                    answer, seconds = plan(hand, mesh, task, 10 * tries, *options)
                rate = answer["suitable"] / max(seconds - reading, 1e-3)
                line.append((answer["suitable"], answer["kept"], answer["closed"], rate))
            (a, b, c, blind), (d, e, f, drawn) = line
            ratio = f"{drawn / blind:.2f}" if blind > 0 else "-"
            name = mesh.split("/")[-1].rsplit(".", 1)[0]
            print(hand.split("/")[-1], name, task, f"{a}/{b}/{c} {blind:.1f}/s", f"{d}/{e}/{f} {drawn:.1f}/s", ratio, flush=True)
