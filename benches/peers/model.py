"""Learning and asking on the paper's network: prehend beside scikit-learn, pgmpy and pyAgrum, each with what it can express.

    python3 -m venv venv && venv/bin/pip install scikit-learn==1.9.1 pgmpy==1.1.2 pyagrum==3.3.1 ipython
    cargo build --release -p prehend-cli && cargo build --release -p prehend-benches --example model_data
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 venv/bin/python benches/peers/model.py target/release [ROWS]

Rows come from a known model (3, 2, 2, 2, 2, 4, 3 components; `benches/src/paper_network.rs`), 3,000 others are held out.
Printed for each tool: user CPU seconds of the fit; mean held-out log density of a whole row (size alone in the second
part); accuracy and log-loss of the task given object (O), and given object, action and constraints (OAC); microseconds a
question, asked for many rows at once where the tool can.

scikit-learn knows mixtures and no network: one 15-dimensional mixture per task, and the node `size` alone, for which both
programs fit the same model. pgmpy's and pyAgrum's Gaussian networks have neither discrete nodes nor mixtures: one network
per task, one Gaussian per node, pyAgrum's with least squares done here. pyAgrum also gets the whole network with every
column in 4 quantile bins.
"""

import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import warnings

import numpy as np
import pandas as pd
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

warnings.filterwarnings("ignore")

TASKS = ["hand-over", "pouring", "tool-use"]
NODES = {
    "size": (["size_x", "size_y", "size_z"], []),
    "cvex": (["cvex"], ["size"]),
    "fvol": (["fvol"], ["size", "cvex"]),
    "qeps": (["qeps"], ["size", "cvex"]),
    "egpc": (["egpc_1", "egpc_2"], ["fvol", "qeps"]),
    "upos": (["upos_x", "upos_y", "upos_z"], ["fvol", "qeps", "egpc"]),
    "dir": (["dir_w", "dir_x", "dir_y", "dir_z"], ["fvol", "qeps", "egpc", "upos"]),
}
COLUMNS = [column for columns, _ in NODES.values() for column in columns]
O = NODES["size"][0] + NODES["cvex"][0]
MOST, MOST_JOINT = 6, 16


def cpu():
    return sum(resource.getrusage(who).ru_utime for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))


def timed(work):
    begin = cpu()
    out = work()
    return out, cpu() - begin


def quality(log_joint, labels):
    """Accuracy and log-loss from log p(task, evidence), a row each."""
    posterior = log_joint - logsumexp(log_joint, axis=1, keepdims=True)
    return (posterior.argmax(1) == labels).mean(), -posterior[np.arange(len(labels)), labels].mean()


def line(tool, fit, held_out, answers):
    text = f"{tool:44} {fit:8.3f} {held_out:10.3f}"
    for accuracy, loss, microseconds in answers:
        text += f"   {accuracy:.3f} {loss:6.3f} {microseconds:9.1f}"
    print(text, flush=True)


def prehend(binaries, folder, train, held, network, targets):
    """Fit and held-out density by `train`, answers by `query`, a row each, reading included."""
    both = pd.concat([train.assign(part="train"), held.assign(part="held")])
    both.to_csv(folder / "rows.csv", index=False)
    (folder / "net.toml").write_text(network)
    environment = os.environ | {"RAYON_NUM_THREADS": "1"}

    def run(*arguments):
        out = subprocess.run([binaries / "prehend", *arguments], capture_output=True, text=True, env=environment)
        if out.returncode:
            sys.exit(out.stderr)
        return out.stdout

    answer, fit = timed(lambda: json.loads(run(
        "train", folder / "rows.csv", "--network", folder / "net.toml", "--holdout-column", "part", "--holdout", "held",
        "--restarts", "3", "--out", folder, "--json")))
    labels = held.task.map(TASKS.index).to_numpy()
    answers = []
    for columns in targets:
        held[columns].to_csv(folder / "seen.csv", index=False)
        text, seconds = timed(lambda: run("query", folder / "net.bin", "--target", "task", "--evidence-file", folder / "seen.csv", "--json"))
        rows = [json.loads(row)["posterior"] for row in text.splitlines() if row]
        log_posterior = np.log([[max(row[task], 1e-300) for task in TASKS] for row in rows])
        answers.append((*quality(log_posterior, labels), 1e6 * seconds / len(held)))
    line("prehend, BIC 1 to 6 (query: the command, by row)", fit, answer["holdout_log_likelihood"] / len(held), answers)


def mixtures(train, held, columns, targets, name, most):
    """One scikit-learn mixture per task, K by BIC, 3 starts."""
    from sklearn.mixture import GaussianMixture

    def learn():
        out = []
        for task in TASKS:
            x = train.loc[train.task == task, columns].to_numpy()
            fits = [GaussianMixture(k, n_init=3, random_state=0).fit(x) for k in range(1, most + 1)]
            out.append(min(fits, key=lambda fit: fit.bic(x)))
        return out

    fits, seconds = timed(learn)
    prior = np.log([(train.task == task).mean() for task in TASKS])
    labels = held.task.map(TASKS.index).to_numpy()

    def joint(seen):
        at = [columns.index(column) for column in seen]
        x = held[seen].to_numpy()
        parts = []
        for fit, log_prior in zip(fits, prior):
            terms = [
                np.log(w) + multivariate_normal.logpdf(x, m[at], c[np.ix_(at, at)])
                for w, m, c in zip(fit.weights_, fit.means_, fit.covariances_)
            ]
            parts.append(log_prior + logsumexp(terms, axis=0))
        return np.column_stack(parts)

    whole = joint(columns)
    answers = []
    for seen in targets:
        log_joint, cost = timed(lambda: joint(seen))
        answers.append((*quality(log_joint, labels), 1e6 * cost / len(held)))
    line(f"{name}, K = {[fit.n_components for fit in fits]}", seconds, whole[np.arange(len(labels)), labels].mean(), answers)


def scalar_arcs():
    """The network with scalar nodes: each column a child of its node's parents and of the columns before it."""
    arcs = []
    for columns, parents in NODES.values():
        for i, column in enumerate(columns):
            above = [c for parent in parents for c in NODES[parent][0]] + columns[:i]
            arcs += [(parent, column) for parent in above]
    return arcs


def gaussian_answers(name, seconds, joints, train, held):
    """Held-out density and answers from one mean and covariance per task, in COLUMNS' order."""
    prior = np.log([(train.task == task).mean() for task in TASKS])
    labels = held.task.map(TASKS.index).to_numpy()

    def joint(seen):
        at = [COLUMNS.index(column) for column in seen]
        x = held[seen].to_numpy()
        parts = [multivariate_normal.logpdf(x, m[at], c[np.ix_(at, at)]) for m, c in joints]
        return prior + np.column_stack(parts)

    whole = joint(COLUMNS)
    answers = []
    for seen in (O, COLUMNS):
        log_joint, cost = timed(lambda: joint(seen))
        answers.append((*quality(log_joint, labels), 1e6 * cost / len(held)))
    line(name, seconds, whole[np.arange(len(labels)), labels].mean(), answers)


def pgmpy_gaussian(train, held):
    from pgmpy.models import LinearGaussianBayesianNetwork

    def learn():
        out = []
        for task in TASKS:
            model = LinearGaussianBayesianNetwork(scalar_arcs())
            model.fit(train.loc[train.task == task, COLUMNS])
            mean, covariance = model.to_joint_gaussian()
            # In a topological order of its own.
            import networkx

            order = list(networkx.topological_sort(model))
            at = [order.index(column) for column in COLUMNS]
            out.append((np.asarray(mean)[at], np.asarray(covariance)[np.ix_(at, at)]))
        return out

    joints, seconds = timed(learn)
    gaussian_answers("pgmpy LinearGaussianBN per task", seconds, joints, train, held)


def pyagrum_gaussian(train, held):
    import pyagrum.clg as clg

    arcs = scalar_arcs()
    parents = {column: [a for a, b in arcs if b == column] for column in COLUMNS}

    def learn():
        out = []
        for task in TASKS:
            x = train.loc[train.task == task, COLUMNS]
            model = clg.CLG()
            for column in COLUMNS:
                design = np.column_stack([np.ones(len(x)), x[parents[column]]])
                beta, *_ = np.linalg.lstsq(design, x[column], rcond=None)
                model.add(clg.GaussianVariable(column, beta[0], (x[column] - design @ beta).std()))
                for parent, slope in zip(parents[column], beta[1:]):
                    model.addArc(parent, column, slope)
            out.append(model)
        return out

    models, seconds = timed(learn)
    prior = np.log([(train.task == task).mean() for task in TASKS])
    some = held.iloc[:20]
    labels = some.task.map(TASKS.index).to_numpy()

    def ask(seen):
        out = []
        for _, row in some.iterrows():
            logs = []
            for model, log_prior in zip(models, prior):
                # log p(evidence): the first seen column given nothing, the second given the first …
                total = log_prior
                for i, column in enumerate(seen):
                    engine = clg.CLGVariableElimination(model)
                    engine.updateEvidence({other: row[other] for other in seen[:i]})
                    found = engine.posterior(column)
                    total += multivariate_normal.logpdf(row[column], found.mu(), found.sigma() ** 2)
                logs.append(total)
            out.append(logs)
        return np.array(out)

    log_joint, cost = timed(lambda: ask(O))
    line("pyAgrum CLG per task (20 rows; O only)", seconds, float("nan"), [(*quality(log_joint, labels), 1e6 * cost / len(some))])


def pyagrum_tables(train, held):
    import pyagrum as gum

    edges = {column: np.quantile(train[column], [0.25, 0.5, 0.75]) for column in COLUMNS}

    def binned(frame):
        out = {column: [f"b{b}" for b in np.digitize(frame[column], edges[column])] for column in COLUMNS}
        return pd.DataFrame({"task": frame.task.to_numpy()} | out)

    def learn():
        net = gum.BayesNet()
        net.add(gum.LabelizedVariable("task", "", TASKS))
        for column in COLUMNS:
            net.add(gum.LabelizedVariable(column, "", [f"b{i}" for i in range(4)]))
        # Every column a child of the task: the whole network has tables of 4¹² rows.
        for column in COLUMNS:
            net.addArc("task", column)
        learner = gum.BNLearner(binned(train), net)
        learner.useSmoothingPrior()
        return learner.learnParameters(net.dag())

    net, seconds = timed(learn)
    rows = binned(held).iloc[:500]
    labels = held.task.iloc[:500].map(TASKS.index).to_numpy()
    answers = []
    for seen in (O, COLUMNS):
        engine = gum.LazyPropagation(net)
        engine.addTarget("task")

        def ask():
            out = []
            for _, row in rows.iterrows():
                engine.setEvidence({column: row[column] for column in seen})
                engine.makeInference()
                out.append(np.log(engine.posterior("task").toarray()))
            return np.array(out)

        log_posterior, cost = timed(ask)
        answers.append((*quality(log_posterior, labels), 1e6 * cost / len(rows)))
    line("pyAgrum, naive tables of 4 bins (500 rows)", seconds, float("nan"), answers)


def main():
    binaries = pathlib.Path(sys.argv[1]).resolve()
    n = sys.argv[2] if len(sys.argv) > 2 else "3600"
    folder = pathlib.Path(tempfile.mkdtemp())

    def data(*arguments):
        return subprocess.run([binaries / "examples" / "model_data", *arguments], capture_output=True, text=True, check=True).stdout

    def rows(count, seed):
        (folder / "drawn.csv").write_text(data("rows", str(count), str(seed)))
        return pd.read_csv(folder / "drawn.csv")

    train, held = rows(n, 1), rows(3000, 99)
    network = data("network", f'{{ max = {MOST}, choose = "bic" }}')
    print(f"{n} rows" + 48 * " " + "fit s   held-out   O: acc   loss  us/question   OAC: acc loss us/question")
    prehend(binaries, folder, train, held, network, (O, COLUMNS))
    mixtures(train, held, COLUMNS, (O, COLUMNS), "scikit-learn, joint per task", MOST_JOINT)
    for peer in (pgmpy_gaussian, pyagrum_gaussian, pyagrum_tables):
        try:
            peer(train, held)
        except Exception as problem:  # a peer that gives up gets a line that says so
            print(f"{peer.__name__}: {type(problem).__name__}: {str(problem)[:120]}", flush=True)
    print("size alone, given the task")
    size = NODES["size"][0]
    alone = "[[node]]".join(network.split("[[node]]")[:3])
    prehend(binaries, folder, train[["task", *size]], held[["task", *size]], alone, (size,))
    mixtures(train, held, size, (size,), "scikit-learn", MOST)


if __name__ == "__main__":
    main()
