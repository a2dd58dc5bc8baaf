"""Recovery of known mixed networks: prehend beside pgmpy, PyBNesian and pyAgrum on the same files.

    python3 -m venv venv && venv/bin/pip install pgmpy==1.1.2 pybnesian==0.5.1 pyagrum==3.3.1
    cargo build --release -p prehend-cli
    venv/bin/python benches/peers/structure.py target/release/prehend [FOLDER]

Each network: a third of the nodes discrete (2 or 3 states), half of the others Gaussian regressions, half mixtures of 2 or
3 regressions; a node has up to 3 parents; 1.3 arcs a node. Tools that know only tables get continuous columns in 4
quantile bins, and the rule that no arc leads from a continuous to a discrete node, which prehend has built in.

SHD counts pairs of nodes whose arc differs (absent, undirected, one way, the other): "CPDAG" between the completed
partially directed graphs of both DAGs (Chickering 1995), "DAG" between the DAGs themselves. Smaller is better. Seconds are
user CPU of the search, reading included.
"""

import json
import pathlib
import resource
import subprocess
import sys
import tempfile
import warnings

import numpy as np
import pandas as pd

warnings.filterwarnings("ignore")

SIZES, ROWS, NETWORKS = (6, 10, 20), (500, 2000, 10000), (1, 2, 3)


def network(n, seed):
    """Nodes in topological order: kind, parents, and what draws them."""
    rng = np.random.default_rng([n, seed])
    n_discrete = n // 3
    names = [f"d{i}" for i in range(n_discrete)] + [f"x{i}" for i in range(n - n_discrete)]
    order = list(range(n))
    parents = {i: [] for i in order}
    pairs = [(a, b) for b in order for a in range(b)]
    rng.shuffle(pairs)
    for a, b in pairs:
        discrete_parents = sum(p < n_discrete for p in parents[b])
        full = len(parents[b]) >= (2 if b < n_discrete else 3) or (a < n_discrete and discrete_parents >= 2)
        if sum(map(len, parents.values())) < round(1.3 * n) and not full:
            parents[b].append(a)
    nodes = []
    for i in order:
        own = sorted(parents[i])
        if i < n_discrete:
            states = int(rng.integers(2, 4))
            nodes.append(dict(name=names[i], states=states, parents=own))
        else:
            k = 1 if (i - n_discrete) % 2 == 0 else int(rng.integers(2, 4))
            nodes.append(dict(name=names[i], k=k, parents=own))
    for node in nodes:
        above = [nodes[p] for p in node["parents"]]
        configurations = int(np.prod([p["states"] for p in above if "states" in p], initial=1))
        regressors = sum("k" in p for p in above)
        if "states" in node:
            node["table"] = rng.dirichlet(0.6 * np.ones(node["states"]), configurations)
        else:
            k = node["k"]
            sign = rng.choice([-1, 1], (configurations, k, regressors))
            node["weights"] = rng.dirichlet(5 * np.ones(k), configurations)
            node["means"] = rng.normal(0, 1.5, (configurations, 1)) + 3.0 * (np.arange(k) - (k - 1) / 2)
            node["slopes"] = sign * rng.uniform(0.4, 1.0, (configurations, k, regressors))
            node["deviation"] = rng.uniform(0.4, 0.9, (configurations, k))
    return nodes


def draw(nodes, n_rows, seed):
    rng = np.random.default_rng([n_rows, seed, 7])
    values = []
    for node in nodes:
        configuration = np.zeros(n_rows, int)
        regressors = []
        for p in node["parents"]:
            if "states" in nodes[p]:
                configuration = configuration * nodes[p]["states"] + values[p]
            else:
                x = values[p]
                regressors.append((x - x.mean()) / x.std())
        if "states" in node:
            cumulative = node["table"].cumsum(1)[configuration]
            values.append((rng.random((n_rows, 1)) > cumulative[:, :-1]).sum(1))
        else:
            cumulative = node["weights"].cumsum(1)[configuration]
            c = (rng.random((n_rows, 1)) > cumulative[:, :-1]).sum(1)
            x = node["means"][configuration, c] + node["deviation"][configuration, c] * rng.normal(size=n_rows)
            for j, r in enumerate(regressors):
                x = x + node["slopes"][configuration, c, j] * r
            values.append(x)
    columns = {}
    for node, v in zip(nodes, values):
        columns[node["name"]] = [f"s{x}" for x in v] if "states" in node else v
    return pd.DataFrame(columns)


def write(nodes, frame, folder):
    text = ""
    for node in nodes:
        text += f'[[node]]\nname = "{node["name"]}"\n'
        if "states" in node:
            states = ", ".join(f'"s{i}"' for i in range(node["states"]))
            text += f'kind = "discrete"\nstates = [{states}]\n'
        else:
            text += 'kind = "gaussian_mixture"\n'
    (folder / "nodes.toml").write_text(text)
    frame.to_csv(folder / "rows.csv", index=False)


def arcs_of(nodes):
    return {(nodes[p]["name"], node["name"]) for node in nodes for p in node["parents"]}


def cpdag(arcs):
    """Compelled arcs as (a, b), the others as both ways: v-structures, then Meek's rules."""
    adjacent = lambda a, b: (a, b) in arcs or (b, a) in arcs
    names = {x for arc in arcs for x in arc}
    directed = {(a, c) for a, c in arcs for b in names if b != a and (b, c) in arcs and not adjacent(a, b)}
    grown = True
    while grown:
        grown = False
        for a, b in arcs - directed:
            chain = any((c, a) in directed and not adjacent(c, b) for c in names)
            cycle = any((a, c) in directed and (c, b) in directed for c in names)
            free = lambda x, y: adjacent(x, y) and (x, y) not in directed and (y, x) not in directed
            kite = any(
                free(a, c) and free(a, d) and (c, b) in directed and (d, b) in directed and not adjacent(c, d)
                for c in names for d in names if c != d
            )
            if chain or cycle or kite:
                directed.add((a, b))
                grown = True
    return directed | {pair for a, b in arcs - directed for pair in ((a, b), (b, a))}


def shd(one, other):
    pairs = {tuple(sorted(arc)) for arc in one | other}
    mark = lambda arcs, a, b: ((a, b) in arcs, (b, a) in arcs)
    return sum(mark(one, a, b) != mark(other, a, b) for a, b in pairs)


def binned(nodes, frame):
    out = frame.copy()
    for node in nodes:
        if "k" in node:
            out[node["name"]] = pd.qcut(frame[node["name"]], 4, labels=False, duplicates="drop").map(lambda b: f"b{b}")
    return out


def forbidden(nodes):
    return [(a["name"], b["name"]) for a in nodes if "k" in a for b in nodes if "states" in b]


def prehend(binary, nodes, frame, folder):
    run = subprocess.run(
        [binary, "learn-structure", folder / "rows.csv", "--network", folder / "nodes.toml", "--json"],
        capture_output=True, text=True, check=True, env={"RAYON_NUM_THREADS": "1"},
    )
    return {(arc["from"], arc["to"]) for arc in json.loads(run.stdout)["arcs"]}


def pgmpy_tables(_, nodes, frame, folder):
    from pgmpy.causal_discovery import ExpertKnowledge
    from pgmpy.estimators import HillClimbSearch

    knowledge = ExpertKnowledge(forbidden_edges=forbidden(nodes))
    search = HillClimbSearch(binned(nodes, frame))
    return set(search.estimate(scoring_method="bic-d", expert_knowledge=knowledge, show_progress=False).edges())


def pgmpy_mixed(_, nodes, frame, folder):
    from pgmpy.causal_discovery import ExpertKnowledge
    from pgmpy.estimators import HillClimbSearch

    frame = frame.copy()
    for node in nodes:
        if "states" in node:
            frame[node["name"]] = frame[node["name"]].astype("category")
    knowledge = ExpertKnowledge(forbidden_edges=forbidden(nodes))
    search = HillClimbSearch(frame)
    return set(search.estimate(scoring_method="bic-cg", expert_knowledge=knowledge, show_progress=False).edges())


def pybnesian_mixed(_, nodes, frame, folder):
    import pybnesian as pb

    frame = frame.copy()
    for node in nodes:
        if "states" in node:
            frame[node["name"]] = frame[node["name"]].astype("category")
    start = pb.CLGNetwork([node["name"] for node in nodes])
    operators = pb.OperatorPool([pb.ArcOperatorSet()])
    learned = pb.GreedyHillClimbing().estimate(operators, pb.BIC(frame), start, patience=5, epsilon=0)
    return {tuple(arc) for arc in learned.arcs()}


def pyagrum_tables(_, nodes, frame, folder):
    import pyagrum as gum

    learner = gum.BNLearner(binned(nodes, frame))
    learner.useScoreBIC()
    learner.useLocalSearchWithTabuList(100, 2)
    for a, b in forbidden(nodes):
        learner.addForbiddenArc(a, b)
    learned = learner.learnDAG()
    names = learner.names()
    return {(names[a], names[b]) for a, b in learned.arcs()}


TOOLS = [
    ("prehend", prehend),
    ("PyBNesian, CLG", pybnesian_mixed),
    ("pgmpy, bic-cg", pgmpy_mixed),
    ("pyAgrum, tables", pyagrum_tables),
    ("pgmpy, tables", pgmpy_tables),
]


def cpu():
    return sum(resource.getrusage(who).ru_utime for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def main():
    binary = pathlib.Path(sys.argv[1]).resolve()
    root = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else tempfile.mkdtemp())
    chosen = sys.argv[3].split(";") if len(sys.argv) > 3 else [name for name, _ in TOOLS]
    print("nodes rows tool                 arcs  CPDAG    DAG  seconds", flush=True)
    for n in SIZES:
        for rows in ROWS:
            for name, tool in TOOLS:
                if name not in chosen:
                    continue
                out = []
                for seed in NETWORKS:
                    nodes = network(n, seed)
                    frame = draw(nodes, rows, seed)
                    folder = root / f"{n}-{rows}-{seed}"
                    folder.mkdir(parents=True, exist_ok=True)
                    write(nodes, frame, folder)
                    truth = arcs_of(nodes)
                    begin = cpu()
                    try:
                        found = tool(binary, nodes, frame, folder)
                    except Exception as problem:  # a peer that gives up gets a line that says so
                        print(f"{n:5} {rows:5} {name:18} {type(problem).__name__}: {str(problem)[:90]}", flush=True)
                        break
                    out.append((len(truth), shd(cpdag(found), cpdag(truth)), shd(found, truth), cpu() - begin))
                else:
                    arcs, c, d, s = np.mean(out, 0)
                    print(f"{n:5} {rows:5} {name:18} {arcs:6.1f} {c:6.1f} {d:6.1f} {s:8.2f}", flush=True)


if __name__ == "__main__":
    main()
