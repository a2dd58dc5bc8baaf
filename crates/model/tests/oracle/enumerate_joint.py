"""Oracle for exact inference and EM: numpy 2.4.6 and scikit-learn 1.9.1, Python 3.11. Writes inference.json and mixture.json.

Inference: every configuration of states, components and signs becomes one joint Gaussian over all continuous
dimensions; conditioning is done on that. Slow and plain, and shares nothing with the eliminations in the crate.
Run: python enumerate_joint.py
"""
import itertools, json
import numpy as np

rng = np.random.default_rng(7)


def spd(d, scale):
    a = rng.normal(size=(d, d + 2))
    return scale * (a @ a.T) / (d + 2)


def mixture(name, d, q, n_config, k, scale=0.1, flat=False):
    rows = []
    for _ in range(n_config):
        w = rng.dirichlet(np.ones(k))
        row = []
        for j in range(k):
            cov = spd(d, scale)
            if flat:
                v = rng.normal(size=(d, 1))
                cov = scale * v @ v.T
            row.append(dict(weight=w[j], mean=rng.normal(size=d).tolist(), coefficients=(0.7 * rng.normal(size=(d, q))).tolist(),
                            covariance=((cov + cov.T) / 2).tolist()))
        rows.append(row)
    return rows


def node(name, columns, dp, cp, comps, **more):
    return dict(name=name, kind="gaussian_mixture", columns=columns, discrete_parents=dp, continuous_parents=cp, components=comps, **more)


nodes = [
    dict(name="task", kind="discrete", states=["hand-over", "pouring", "tool-use"], parents=[], table=[[0.2, 0.5, 0.3]]),
    dict(name="wet", kind="discrete", states=["no", "yes"], parents=["task"], table=[[0.9, 0.1], [0.2, 0.8], [1.0, 0.0]]),
    node("size", ["size_x", "size_y"], ["task"], [], mixture("size", 2, 0, 3, 2)),
    node("fvol", ["fvol"], ["task"], ["size"], mixture("fvol", 1, 2, 3, 2)),
    node("qeps", ["qeps"], ["task", "wet"], ["size"], mixture("qeps", 1, 2, 6, 2)),
    node("egpc", ["egpc_1", "egpc_2"], [], ["fvol", "qeps"], mixture("egpc", 2, 2, 1, 3, flat=False)),
    node("upos", ["upos_x", "upos_y", "upos_z"], ["task"], ["qeps", "egpc"], mixture("upos", 3, 3, 3, 2), sphere=True),
    node("dir", ["dir_w", "dir_x"], [], ["fvol", "upos"], mixture("dir", 2, 4, 1, 2), sign="latent", sphere=True),
    node("rigid", ["rigid_a", "rigid_b"], [], ["size"], mixture("rigid", 2, 2, 1, 2, flat=True)),
]
by = {n["name"]: n for n in nodes}
cont = [n for n in nodes if n["kind"] != "discrete"]
start, total = {}, 0
for n in cont:
    start[n["name"]] = total
    total += len(n["columns"])


def joints():
    """log weight, states, mean, covariance of each configuration."""
    for t in range(3):
        for w in range(2):
            lp = np.log(by["task"]["table"][0][t])
            pw = by["wet"]["table"][t][w]
            if pw == 0:
                continue
            lp += np.log(pw)
            options = []
            for n in cont:
                cfg = {(): 0, ("task",): t, ("task", "wet"): 2 * t + w}[tuple(n["discrete_parents"])]
                opts = []
                for c in n["components"][cfg]:
                    for s in ([1, -1] if n.get("sign") == "latent" else [1]):
                        opts.append((np.log(c["weight"]) - (np.log(2) if n.get("sign") == "latent" else 0), s, c))
                options.append(opts)
            for combo in itertools.product(*options):
                lw, mean, cov = lp, np.zeros(total), np.zeros((total, total))
                for n, (l, s, c) in zip(cont, combo):
                    lw += l
                    a, d = start[n["name"]], len(n["columns"])
                    B = np.zeros((d, total))
                    col = 0
                    C = np.array(c["coefficients"]).reshape(d, -1)
                    for p in n["continuous_parents"]:
                        wd = len(by[p]["columns"])
                        B[:, start[p]:start[p] + wd] = s * C[:, col:col + wd]
                        col += wd
                    mean[a:a + d] = s * np.array(c["mean"]) + B @ mean
                    cross = B @ cov
                    own = B @ cov @ B.T + np.array(c["covariance"])
                    cov[a:a + d, :] = cross
                    cov[:, a:a + d] = cross.T
                    cov[a:a + d, a:a + d] = own
                yield lw, dict(task=t, wet=w), mean, cov


def lognormal(x, m, S):
    L = np.linalg.cholesky(S)
    r = np.linalg.solve(L, x - m)
    return -0.5 * r @ r - np.log(np.diag(L)).sum() - 0.5 * len(x) * np.log(2 * np.pi)


def lse(v):
    v = np.array(v)
    m = v.max()
    return m + np.log(np.exp(v - m).sum())


def ask(evidence, target, at=None):
    rows, values, noise = [], [], []
    H = []
    for name, v in evidence.items():
        n = by[name]
        if n["kind"] == "discrete":
            continue
        a, d = start[name], len(n["columns"])
        if isinstance(v, dict):
            for i in range(d):
                e = np.zeros(total); e[a + i] = 1; H.append(e)
            values += v["mean"]; noise.append(np.array(v["covariance"]))
        else:
            v = v if isinstance(v, list) else [v]
            for i, x in enumerate(v):
                if x is not None:
                    e = np.zeros(total); e[a + i] = 1; H.append(e); values.append(x); noise.append(np.zeros((1, 1)))
    H = np.array(H).reshape(-1, total); values = np.array(values)
    R = np.zeros((len(values), len(values))); i = 0
    for b in noise:
        R[i:i + len(b), i:i + len(b)] = b; i += len(b)
    terms = []
    for lw, states, m, S in joints():
        ok = lw
        for name, v in evidence.items():
            n = by[name]
            if n["kind"] != "discrete":
                continue
            if isinstance(v, dict):
                l = v["likelihood"].get(n["states"][states[name]], 0)
                ok = ok + (np.log(l) if l > 0 else -np.inf)
            elif n["states"][states[name]] != v:
                ok = -np.inf
        if ok == -np.inf:
            continue
        if len(values):
            Sy = H @ S @ H.T + R
            ok += lognormal(values, H @ m, Sy)
            K = S @ H.T @ np.linalg.inv(Sy)
            m = m + K @ (values - H @ m)
            S = S - K @ H @ S
        terms.append((ok, states, m, S))
    le = lse([t[0] for t in terms])
    out = dict(evidence=evidence, target=target, log_evidence=le)
    w = np.exp(np.array([t[0] for t in terms]) - le)
    n = by[target]
    if n["kind"] == "discrete":
        p = np.zeros(len(n["states"]))
        for wi, t in zip(w, terms):
            p[t[1][target]] += wi
        out["posterior"] = p.tolist()
    else:
        a, d = start[target], len(n["columns"])
        mean = sum(wi * t[2][a:a + d] for wi, t in zip(w, terms))
        cov = sum(wi * (t[3][a:a + d, a:a + d] + np.outer(t[2][a:a + d] - mean, t[2][a:a + d] - mean)) for wi, t in zip(w, terms))
        out["mean"], out["covariance"] = mean.tolist(), cov.tolist()
        if at is not None:
            out["at"] = at
            out["log_density"] = [lse([t[0] - le + lognormal(np.array(x), t[2][a:a + d], t[3][a:a + d, a:a + d]) for t in terms]) for x in at]
    return out


O = dict(size=[0.3, -0.2])
A = dict(egpc=[0.1, 0.4], upos=[0.2, -0.5, 0.3], dir=[0.4, -0.7])
C = dict(fvol=0.2, qeps=-0.4)
cases = [
    ask({}, "task"), ask(O, "task"), ask({**O, **A}, "task"), ask({**O, **A, **C}, "task"), ask(A, "task"),
    ask({"task": "pouring", **O}, "upos", [[0.1, 0.2, 0.3], [1.0, 0.0, 0.0]]),
    ask({"task": "tool-use"}, "dir", [[0.5, 0.5], [-0.5, -0.5]]),
    ask({"size": [0.3, None], "upos": [None, 0.4, None]}, "task"),
    ask({"size": [0.3, None], "upos": [None, 0.4, None]}, "qeps", [[0.0], [1.0]]),
    ask({"size": {"mean": [0.3, -0.2], "covariance": [[0.04, 0.01], [0.01, 0.02]]}, "fvol": 0.3}, "size", [[0.2, 0.0]]),
    ask({"task": {"likelihood": {"pouring": 0.5, "hand-over": 2.0}}, **C}, "task"),
    ask({"wet": "yes", **O}, "task"), ask({**O, **A}, "wet"),
    ask({"upos": [20.0, -20.0, 15.0], **O}, "task"),
    ask({"rigid": [0.5, 0.1]}, "task"), ask({"rigid": [0.5, None]}, "size", [[0.0, 0.0]]),
    ask({**O, "dir": [0.4, -0.7]}, "fvol", [[0.1]]),
]
json.dump(dict(model=dict(format="prehend-model", version=1, nodes=nodes), cases=cases), open("inference.json", "w"), indent=None, separators=(",", ":"))

from sklearn.mixture import GaussianMixture
x = np.concatenate([rng.normal([0, 0], [0.3, 0.6], (120, 2)), rng.normal([2, 1], [0.5, 0.2], (80, 2))]).round(4)
g = GaussianMixture(2, n_init=5, tol=1e-8, max_iter=2000, reg_covar=0, random_state=0).fit(x)
bic = [GaussianMixture(k, n_init=5, tol=1e-6, max_iter=2000, random_state=0).fit(x).bic(x) for k in (1, 2)]
json.dump(dict(rows=x.tolist(), mean_log_likelihood=g.score(x), weights=g.weights_.tolist(), means=g.means_.tolist(), covariances=g.covariances_.tolist(), bic=bic),
          open("mixture.json", "w"), separators=(",", ":"))
print(len(cases), "cases", [round(c["log_evidence"], 3) for c in cases])
