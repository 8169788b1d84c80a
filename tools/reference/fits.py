#!/usr/bin/env python3
"""Answers of SciPy, scikit-learn and NumPy to the fits of `sapwise train`, for the tests of the lab.

    python3 -m venv V && V/bin/pip install numpy scipy scikit-learn
    V/bin/python tools/reference/fits.py > crates/lab/tests/fixtures/fits.json

The stored numbers are the output of this script and are not edited; `crates/lab/src/evaluate/reference.rs` holds the fits in Rust
against them, so that a test needs no Python. The problems are the same on every run, and the versions that gave the answers
stand in the file. Inputs have few digits, so that both sides solve the same problem exactly as it is written.
"""

import json
import platform
import sys

import numpy
import scipy
import sklearn
from scipy.optimize import least_squares, nnls
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, RationalQuadratic
from sklearn.linear_model import LinearRegression

SEED = 2011
# The constants of crates/lab/src/fit/robust.rs.
HUBER, MAD_TO_SD, SMALLEST_SPREAD = 1.345, 1.4826, 1e-3


def few_digits(values):
    """Values with six digits, as float64 reads them back from JSON."""
    return numpy.vectorize(lambda v: float(f"{v:.6g}"))(values)


def non_negative(name, a, b):
    # SciPy's tolerance is absolute, so it gets columns of length one.
    a, b = few_digits(a), few_digits(b)
    lengths = numpy.linalg.norm(a, axis=0)
    x, residual = nnls(a / lengths, b, maxiter=1000)
    unique = bool(numpy.linalg.matrix_rank(a / lengths) == a.shape[1])
    return dict(name=name, a=a.tolist(), b=b.tolist(), x=(x / lengths).tolist(), residual=residual, unique=unique)


def non_negative_problems(random):
    a = random.normal(size=(14, 5))
    yield non_negative("well conditioned", a, a @ [1.0, 0.5, 2.0, 0.1, 3.0] + 0.1 * random.normal(size=14))
    # Nanoseconds of a constant, of objects, and of pairs.
    n = 10.0 ** numpy.linspace(1, 4.5, 16)
    a = numpy.stack([numpy.ones(16), n, n**2], axis=1)
    yield non_negative("nine orders of magnitude", a, a @ [40.0, 2.0, 1e-4] + 3 * random.normal(size=16))
    a = random.normal(size=(12, 5))
    yield non_negative("active constraints", a, a @ [1.0, -2.0, 0.5, -0.3, 2.0] + 0.5 * random.normal(size=12))
    a = numpy.abs(random.normal(size=(12, 6)))
    yield non_negative("correlated and active", a + 3 * a[:, :1], random.normal(size=12) + 2)
    # Few digits, so that the third column is the sum of the first two to the last one.
    a = numpy.round(random.uniform(size=(12, 4)), 3)
    a[:, 2] = a[:, 0] + a[:, 1]
    yield non_negative("rank deficient", a, a @ [1.0, 2.0, 0.5, 0.2] + 0.1 * random.normal(size=12))
    yield non_negative("nothing to explain", numpy.abs(a[:, :2]) + 0.1, -numpy.ones(12))


def residual(random, by_motion):
    """A Gaussian process over the load. Ours has inducing points; where these are all of the loads, it is the same."""
    def loads(count):
        objects = numpy.round(10 ** random.uniform(1, 6, size=count))
        ratios = few_digits(random.uniform([0, 0.5, 1], [3, 10, 100], size=(count, 3)))
        return numpy.column_stack([objects, objects[:, None] * ratios, few_digits(random.uniform(0, 1, size=count))])

    def coordinates(loads):
        n = loads[:, 0]
        figures = [numpy.log2(n), numpy.log2(loads[:, 1] / n + 0.05), numpy.log2(loads[:, 2] / n + 1), numpy.log2(loads[:, 3] / n + 1)]
        figures = [f / length for f, length in zip(figures, (3, 3, 4, 6))]
        return numpy.stack(figures + ([loads[:, 4] / 0.375] if by_motion else []), axis=1)

    known, at = loads(30), loads(60)
    at = at[(at[:, 0] >= known[:, 0].min()) & (at[:, 0] <= known[:, 0].max())][:8]
    ln = few_digits(0.2 * numpy.sin(known[:, 1] / known[:, 0]) + 0.05 * random.normal(size=len(known)))
    behind = few_digits(random.uniform(1, 6, size=len(known)))
    kernel = ConstantKernel(0.2**2, "fixed") * RationalQuadratic(1.0, 16.0, "fixed", "fixed")
    noise = (0.08 * numpy.minimum(behind, 4)) ** 2
    process = GaussianProcessRegressor(kernel, alpha=noise, optimizer=None).fit(coordinates(known), ln)
    answers = dict(loads=known.tolist(), ln=ln.tolist(), behind=behind.tolist(), at=at.tolist())
    return dict(by_motion=by_motion, **answers, predictions=process.predict(coordinates(at)).tolist())


def ordinary(random, rows):
    x = few_digits(random.normal(size=(rows, 4)) * [0.4, 0.7, 1.1, 0.6] + [1, 2, 1.5, 8])
    y = few_digits(6 - 0.7 * x[:, 1] + 0.4 * x[:, 3] + 0.2 * random.normal(size=rows))
    at = few_digits(random.normal(size=4) + [1, 2, 1.5, 8])
    line = LinearRegression().fit(x, y)
    leverages = numpy.diag(design(x) @ numpy.linalg.pinv(design(x)))
    prediction = float(line.predict([at])[0])
    return dict(x=x.tolist(), y=y.tolist(), at=at.tolist(), prediction=prediction, leverages=leverages.tolist())


def design(x):
    return numpy.column_stack([numpy.ones(len(x)), x])


def spread(errors):
    return max(MAD_TO_SD * numpy.median(numpy.abs(errors - numpy.median(errors))), SMALLEST_SPREAD)


def robust(name, terms, ns, weights, groups):
    """Huber's loss on ln(modelled / measured) over units that are not negative, its bend at 1.345 spreads of its own errors."""
    random = numpy.random.default_rng(SEED)
    terms, ns = few_digits(terms), few_digits(ns)
    scales = numpy.median(ns[:, None] / terms, axis=0)

    def errors(units):
        return numpy.log(numpy.maximum(terms * scales @ units, 1e-9 * ns) / ns)

    def solve(start, bend):
        # A row of weight two is two rows.
        return least_squares(lambda units: numpy.repeat(errors(units), weights), start, bounds=(0, numpy.inf), loss="huber",
                             f_scale=bend, xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=5000)

    units = numpy.ones(terms.shape[1])
    bend = HUBER * spread(errors(units))
    for _ in range(300):
        units = solve(units, bend).x
        # Halfway, since near a bound the spread overshoots.
        before, bend = bend, (bend * HUBER * spread(errors(units))) ** 0.5
        if abs(bend / before - 1) < 1e-6:
            break
    else:
        sys.exit(f"{name}: the spread does not settle")
    starts = [units] + [random.uniform(0.1, 1.5, size=len(units)) for _ in range(5)]
    end = min((solve(start, bend) for start in starts), key=lambda end: end.cost)
    problem = dict(terms=terms.tolist(), ns=ns.tolist(), weights=weights.tolist(), groups=groups.tolist())
    return dict(name=name, **problem, bend=float(bend), units=(end.x * scales).tolist(), cost=float(end.cost))


def robust_problems(random):
    n = 2.0 ** numpy.linspace(4, 17, 40)
    ones, objects, sorts = numpy.ones(40), n, n * numpy.log2(n)
    one, noise = numpy.ones(40, dtype=int), lambda sigma: numpy.exp(sigma * random.normal(size=40))
    terms = numpy.stack([ones, objects], axis=1)
    yield robust("noise", terms, (500 + 3 * n) * noise(0.2), one, 0 * one)
    ns = (500 + 3 * n) * noise(0.05)
    # Below a fifth of the measured time our reweighting is bounded, and its end is not the least error.
    ns[[3, 11, 25, 38]] *= [4, 0.2, 3, 4.5]
    yield robust("outliers", terms, ns, one, 0 * one)
    terms = numpy.stack([ones, objects, sorts], axis=1)
    ns = (800 + 0.6 * n * numpy.log2(n)) * noise(0.1) * numpy.where(n > 3e4, 1.15, 1.0)
    yield robust("a term at zero", terms, ns, one, 0 * one)
    weights, groups = 1 + (numpy.arange(40) % 3 == 0), numpy.arange(40) // 10
    ns = (500 + 3 * n) * noise(0.1) * numpy.where(groups == 3, 1.3, 1.0)
    yield robust("weights and profiles", terms[:, :2], ns, weights, groups)


def quantiles(samples):
    shares = [0.0, 0.05, 0.25, 0.5, 0.75, 0.9, 1.0]
    samples = few_digits(samples)
    values = numpy.percentile(samples, [100 * q for q in shares])
    iqr = (values[4] - values[2]) / abs(values[3])
    return dict(samples=samples.tolist(), shares=shares, values=values.tolist(), relative_iqr=float(iqr))


def main():
    # One generator for each kind, so that a new problem of one kind leaves the others as they are.
    random = [numpy.random.default_rng([SEED, kind]) for kind in range(6)]
    versions = {"python": platform.python_version()} | {m.__name__: m.__version__ for m in (numpy, scipy, sklearn)}
    answers = dict(
        made_by="tools/reference/fits.py",
        versions=versions,
        nnls=list(non_negative_problems(random[0])),
        residual=[residual(random[1], by_motion) for by_motion in (False, True)],
        least_squares=[ordinary(random[3], rows) for rows in (7, 20)],
        robust=list(robust_problems(random[4])),
        quantiles=[quantiles(numpy.exp(random[5].normal(size=count)) * 1e4) for count in (4, 5, 12, 31)],
    )
    lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in answers.items())
    print("{\n" + lines + "\n}")


main()
