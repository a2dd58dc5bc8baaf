"""Numbers for tests/directions.rs. Python 3.11, scipy 1.17.1, numpy 2.4.6: python3 directions.py > directions.json

"von_mises_fisher": log densities of scipy.stats.vonmises_fisher (κ up to where its Bessel function holds).
"gaussian_on_sphere": log of a Gaussian mixture's density divided by its integral over the unit sphere of ℝ³, the
integral by scipy.integrate.dblquad in polar angles; also with both signs of the mean (a latent sign).
"""

import json

import numpy as np
import scipy
from scipy import integrate, stats

rng = np.random.default_rng(4)


def unit(x):
    x = np.asarray(x, float)
    return x / np.linalg.norm(x)


fisher = []
for d in (2, 3, 4, 7):
    for kappa in (1e-3, 0.5, 8.0, 60.0, 500.0):
        mu = unit(rng.normal(size=d))
        x = unit(mu + 2 / (1 + np.sqrt(kappa)) * rng.normal(size=d))
        density = stats.vonmises_fisher(mu, kappa).logpdf(x)
        fisher.append(dict(direction=mu.tolist(), concentration=kappa, x=x.tolist(), log_density=float(density)))

mean = np.array([[0.5, -0.2, 0.7], [-0.8, 0.1, 0.3]])
root = np.array([[[0.3, 0, 0], [0.1, 0.25, 0], [-0.05, 0.1, 0.4]], [[0.2, 0, 0], [0, 0.35, 0], [0.1, 0, 0.3]]])
covariance = root @ root.transpose(0, 2, 1)
weight = np.array([0.35, 0.65])
parts = [stats.multivariate_normal(m, c) for m, c in zip(mean, covariance)]


def density(x, both):
    total = 0.0
    for w, p in zip(weight, parts):
        total += w * (0.5 * (p.pdf(x) + p.pdf(-x)) if both else p.pdf(x))
    return total


def normalizer(both):
    def ring(phi, theta):
        s = np.sin(theta)
        return s * density(np.array([s * np.cos(phi), s * np.sin(phi), np.cos(theta)]), both)

    return integrate.dblquad(ring, 0, np.pi, 0, 2 * np.pi, epsabs=1e-10, epsrel=1e-10)[0]


at = [unit(v).tolist() for v in rng.normal(size=(5, 3))]
sphere = dict(
    weight=weight.tolist(),
    mean=mean.tolist(),
    covariance=covariance.tolist(),
    at=at,
    fixed=[float(np.log(density(np.array(x), False) / normalizer(False))) for x in at],
    latent=[float(np.log(density(np.array(x), True) / normalizer(True))) for x in at],
)
print(json.dumps(dict(scipy=scipy.__version__, von_mises_fisher=fisher, gaussian_on_sphere=sphere), indent=1))
