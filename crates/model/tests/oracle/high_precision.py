"""Oracle for exact inference: mpmath 1.3.0 with 60 digits, numpy 2.4.6, Python 3.11. Writes high_precision.json.

Random and hand-made mixed networks; every configuration of states, components and signs becomes one joint Gaussian over
all continuous dimensions, in 60 digits, from the very numbers (binary64) that stand in the file; evidence is conditioned on
by solving with that matrix. Nothing is shared with the eliminations in the crate.
Run: python high_precision.py
"""
import itertools, json
import numpy as np
from mpmath import mp, mpf, matrix, lu_solve, log, exp, pi, det

mp.dps = 60
rng = np.random.default_rng(2026)


def spd(d, kind):
    if kind == "singular":
        v = rng.integers(-64, 65, size=d) / 64.0  # products of these are exact
        return np.outer(v, v)
    q, _ = np.linalg.qr(rng.normal(size=(d, d)))
    low, high = {"plain": (0.2, 1.0), "ill": (1e-8, 1.0), "tiny": (1e-10, 1e-9)}[kind]
    e = np.exp(rng.uniform(np.log(low), np.log(high), size=d))
    if d > 1:
        e[0], e[-1] = low, high
    s = (q * e) @ q.T
    return (s + s.T) / 2


def dirichlet(n, zero):
    p = rng.dirichlet(np.ones(n))
    if zero and n > 1:
        p[rng.integers(n)] = 0
        p /= p.sum()
    return p.tolist()


def random_model(kinds, zero, sign):
    while True:
        nodes, configurations = [], 1
        n_disc, n_cont = rng.integers(1, 4), rng.integers(2, 5)
        for i in range(n_disc):
            parents = [n for n in nodes if rng.random() < 0.5]
            k = int(rng.integers(2, 4))
            rows = int(np.prod([len(p["states"]) for p in parents]))
            nodes.append(dict(name=f"d{i}", kind="discrete", states=[f"s{j}" for j in range(k)], parents=[p["name"] for p in parents],
                              table=[dirichlet(k, zero) for _ in range(rows)]))
            configurations *= k
        disc = list(nodes)
        cont = []
        for i in range(n_cont):
            dp = [n for n in disc if rng.random() < 0.5]
            cp = [n for n in cont if rng.random() < 0.6]
            d, k = int(rng.integers(1, 4)), int(rng.integers(1, 4))
            q = sum(len(p["columns"]) for p in cp)
            kind = kinds[i % len(kinds)]
            signed = sign and i == n_cont - 1
            rows = []
            for _ in range(int(np.prod([len(p["states"]) for p in dp]))):
                w = dirichlet(k, zero and k > 1)
                rows.append([dict(weight=w[j], mean=rng.normal(size=d).tolist(), coefficients=(0.8 * rng.normal(size=(d, q))).tolist(),
                                  covariance=spd(d, kind).tolist()) for j in range(k)])
            more = dict(sign="latent") if signed else {}
            cont.append(dict(name=f"c{i}", kind="gaussian_mixture", columns=[f"c{i}_{j}" for j in range(d)], discrete_parents=[p["name"] for p in dp],
                             continuous_parents=[p["name"] for p in cp], components=rows, **more))
            configurations *= k * (2 if signed else 1)
        if configurations <= 250:
            return nodes + cont


class Oracle:
    def __init__(self, nodes):
        self.nodes = nodes
        self.by = {n["name"]: n for n in nodes}
        self.disc = [n for n in nodes if n["kind"] == "discrete"]
        self.cont = [n for n in nodes if n["kind"] != "discrete"]
        self.start, self.total = {}, 0
        for n in self.cont:
            self.start[n["name"]] = self.total
            self.total += len(n["columns"])
        self.joint = list(self.joints())

    def row(self, parents, states):
        r = 0
        for p in parents:
            r = r * len(self.by[p]["states"]) + states[p]
        return r

    def joints(self):
        for combo in itertools.product(*[range(len(n["states"])) for n in self.disc]):
            states = {n["name"]: s for n, s in zip(self.disc, combo)}
            w = mpf(1)
            for n in self.disc:
                w *= mpf(n["table"][self.row(n["parents"], states)][states[n["name"]]])
            if w == 0:
                continue
            options = []
            for n in self.cont:
                r = self.row(n["discrete_parents"], states)
                signs = [1, -1] if n.get("sign") == "latent" else [1]
                options.append([(c, s, len(signs)) for c in n["components"][r] if c["weight"] > 0 for s in signs])
            for choice in itertools.product(*options):
                lw, m, S = log(w), matrix(self.total, 1), matrix(self.total, self.total)
                for n, (c, s, share) in zip(self.cont, choice):
                    lw += log(mpf(c["weight"]) / share)
                    a, d = self.start[n["name"]], len(n["columns"])
                    B = matrix(d, self.total)
                    col = 0
                    for p in n["continuous_parents"]:
                        for j in range(len(self.by[p]["columns"])):
                            for i in range(d):
                                B[i, self.start[p] + j] = s * mpf(c["coefficients"][i][col])
                            col += 1
                    mean, cross = B * m, B * S
                    own = cross * B.T
                    for i in range(d):
                        m[a + i] = s * mpf(c["mean"][i]) + mean[i]
                        for j in range(self.total):
                            S[a + i, j] = cross[i, j]
                            S[j, a + i] = cross[i, j]
                    for i in range(d):
                        for j in range(d):
                            S[a + i, a + j] = own[i, j] + mpf(c["covariance"][i][j])
                yield lw, states, m, S

    def ask(self, evidence, targets, at=()):
        rows, values, noise = [], [], []
        for name, v in evidence.items():
            n = self.by[name]
            if n["kind"] == "discrete":
                continue
            a, d = self.start[name], len(n["columns"])
            if isinstance(v, dict):
                for i in range(d):
                    for j in range(d):
                        noise.append((len(rows) + i, len(rows) + j, mpf(v["covariance"][i][j])))
                rows += range(a, a + d)
                values += v["mean"]
            else:
                for i, x in enumerate(v if isinstance(v, list) else [v]):
                    if x is not None:
                        rows.append(a + i)
                        values.append(x)
        k = len(rows)
        R = matrix(k, k)
        for i, j, x in noise:
            R[i, j] = x
        y = matrix([mpf(v) for v in values]) if k else None
        terms = []
        for lw, states, m, S in self.joint:
            ok = lw
            for name, v in evidence.items():
                n = self.by[name]
                if n["kind"] != "discrete":
                    continue
                if isinstance(v, dict):
                    l = v["likelihood"].get(n["states"][states[name]], 0)
                    ok = None if l == 0 else ok + log(mpf(l))
                elif n["states"][states[name]] != v:
                    ok = None
                if ok is None:
                    break
            if ok is None:
                continue
            if k:
                Syy = matrix(k, k)
                Sxy = matrix(self.total, k)
                for i in range(k):
                    for j in range(k):
                        Syy[i, j] = S[rows[i], rows[j]] + R[i, j]
                    for j in range(self.total):
                        Sxy[j, i] = S[j, rows[i]]
                r = y - matrix([m[i] for i in rows])
                sol = lu_solve(Syy, r)
                ok += -(r.T * sol)[0] / 2 - log(det(Syy)) / 2 - k * log(2 * pi) / 2
                m = m + Sxy * sol
                gain = matrix(self.total, k)
                for i in range(k):
                    e = matrix(k, 1)
                    e[i] = 1
                    col = lu_solve(Syy, e)
                    for j in range(self.total):
                        gain[j, i] = sum(Sxy[j, q] * col[q] for q in range(k))
                S = S - gain * Sxy.T
            terms.append((ok, states, m, S))
        top = max(t[0] for t in terms)
        le = top + log(sum(exp(t[0] - top) for t in terms))
        w = [exp(t[0] - le) for t in terms]
        out = dict(evidence=evidence, targets=targets, log_evidence=float(le))
        posterior = {}
        for t in targets:
            n = self.by[t]
            if n["kind"] == "discrete":
                p = [mpf(0)] * len(n["states"])
                for wi, term in zip(w, terms):
                    p[term[1][t]] += wi
                posterior[t] = [float(x) for x in p]
        if posterior:
            out["posterior"] = posterior
        disc = [t for t in targets if self.by[t]["kind"] == "discrete"]
        if len(disc) > 1:
            joint = {}
            for wi, term in zip(w, terms):
                key = ",".join(self.by[t]["states"][term[1][t]] for t in disc)
                joint[key] = joint.get(key, mpf(0)) + wi
            out["joint"] = {key: float(p) for key, p in joint.items()}
        dims = [self.start[t] + i for t in targets if self.by[t]["kind"] != "discrete" for i in range(len(self.by[t]["columns"]))]
        if dims:
            mean = [sum(wi * t[2][i] for wi, t in zip(w, terms)) for i in dims]
            cov = [[sum(wi * (t[3][i, j] + (t[2][i] - mean[a]) * (t[2][j] - mean[b])) for wi, t in zip(w, terms)) for b, j in enumerate(dims)] for a, i in enumerate(dims)]
            out["mean"], out["covariance"] = [float(x) for x in mean], [[float(x) for x in r] for r in cov]
            if at:
                densities, flat = [], False
                for x in at:
                    logs = []
                    for wi, (ok, _, m, S) in zip(w, terms):
                        sub = matrix([[S[i, j] for j in dims] for i in dims])
                        # A standard deviation that the evidence or a singular covariance leaves at zero.
                        scale = mpf(1)
                        for i in range(len(dims)):
                            scale *= sub[i, i]
                        if scale <= 0 or det(sub) <= mpf(10) ** -22 * scale:
                            flat = True
                            break
                        r = matrix([mpf(v) for v in x]) - matrix([m[i] for i in dims])
                        logs.append(ok - le - (r.T * lu_solve(sub, r))[0] / 2 - log(det(sub)) / 2 - len(dims) * log(2 * pi) / 2)
                    if flat:
                        break
                    big = max(logs)
                    densities.append(float(big + log(sum(exp(l - big) for l in logs))))
                if not flat:
                    out["at"], out["log_density"] = [list(x) for x in at], densities
        return out


def sample(o):
    weights = np.array([float(exp(j[0])) for j in o.joint])
    _, states, m, S = o.joint[rng.choice(len(weights), p=weights / weights.sum())]
    S = np.array(S.tolist(), dtype=float)
    e, v = np.linalg.eigh((S + S.T) / 2)
    x = np.array([float(a) for a in m]) + v @ (np.sqrt(np.maximum(e, 0)) * rng.normal(size=o.total))
    return states, x, np.sqrt(np.maximum(np.diag(S), 1e-12))


def queries(o, n, full_evidence):
    """`full_evidence`: names of continuous nodes that may be observed without error in all dimensions at once."""
    cases, tried = [], 0
    while len(cases) < n:
        tried += 1
        states, x, sd = sample(o)
        far = rng.random() < 0.2
        names = [node["name"] for node in o.nodes]
        targets = list(rng.choice(names, size=min(len(names), int(rng.choice([1, 1, 1, 2]))), replace=False))
        evidence = {}
        for node in o.nodes:
            name = node["name"]
            if name in targets and rng.random() < 0.9 or rng.random() < 0.35:
                continue
            if node["kind"] == "discrete":
                if rng.random() < 0.4:
                    evidence[name] = dict(likelihood={s: float(np.round(rng.uniform(0, 2), 3)) for s in node["states"] if rng.random() < 0.9} or {node["states"][states[name]]: 1.0})
                    if node["states"][states[name]] not in evidence[name]["likelihood"]:
                        evidence[name]["likelihood"][node["states"][states[name]]] = 0.5
                else:
                    evidence[name] = node["states"][states[name]]
                continue
            a, d = o.start[name], len(node["columns"])
            value = x[a:a + d].copy()
            if far and rng.random() < 0.5:
                value += 60 * sd[a:a + d] * rng.choice([-1, 1], size=d)
            value = value.tolist()
            kind = rng.choice(["whole", "part", "uncertain"])
            if kind == "uncertain" or name not in full_evidence and d == 1:
                evidence[name] = dict(mean=value, covariance=spd(d, "plain").tolist())
            elif kind == "part" and d > 1 or name not in full_evidence:
                hidden = int(rng.integers(d))
                evidence[name] = [None if i == hidden or d > 2 and name not in full_evidence and i != (hidden + 1) % d else v for i, v in enumerate(value)]
            else:
                evidence[name] = value if d > 1 else value[0]
        at = []
        dims = [o.start[t] + i for t in targets if o.by[t]["kind"] != "discrete" for i in range(len(o.by[t]["columns"]))]
        if dims:
            at = [[float(x[i]) for i in dims], [float(x[i] + 3 * sd[i]) for i in dims]]
        try:
            cases.append(o.ask(evidence, [str(t) for t in targets], at))
        except ZeroDivisionError:
            pass  # no density: such evidence is in the tests of errors
        if tried > 10 * n:
            raise RuntimeError("too many attempts")
    return cases


plans = [(["plain"], False, False)] * 4 + [(["plain"], True, False)] * 2 + [(["plain"], False, True)] * 2 + [(["ill"], False, False)] * 3 \
    + [(["plain", "singular"], False, False)] * 3 + [(["plain", "tiny"], True, False)] * 2
models = []
for kinds, zero, sign in plans:
    nodes = random_model(kinds, zero, sign)
    o = Oracle(nodes)
    # A singular node may be observed in one dimension at most; the plain ones wholly.
    full = [n["name"] for i, n in enumerate(o.cont) if kinds[i % len(kinds)] != "singular"]
    cases = queries(o, 11, full)
    models.append(dict(kind="+".join(kinds) + (" zero" if zero else "") + (" sign" if sign else ""),
                       model=dict(format="prehend-model", version=1, nodes=nodes), cases=cases))
    print(models[-1]["kind"], len(o.joint), "configurations", len(cases), "cases", flush=True)
json.dump(models, open("high_precision.json", "w"), separators=(",", ":"))
print(sum(len(m["cases"]) for m in models), "cases in", len(models), "models")
