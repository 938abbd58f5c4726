"""Least squares over the batches of known runs, validated on whole runs left out."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.ratio_index.regression import RegressionModel, scaled_columns, term_columns
from gateway.records import F64, I64

RIDGE: Final = 1e-12  # chosen: of the Gram matrix's mean diagonal; keeps it invertible without one run


@dataclass(frozen=True, slots=True)
class FittedRegression:
    """A regression, the regressions without each run by rising number, and their errors (n,) on these runs."""

    model: RegressionModel
    without: tuple[RegressionModel, ...]
    held_out_errors: F64


def fit_regression(terms: tuple[str, ...], ra: F64, rg: F64, target: F64, run: I64) -> FittedRegression:
    """target (n,) on the named terms of ra, rg (n,); run (n,) numbers.

    Batches of one run share road and load and are not independent. So the residual spread is the root mean square over
    runs held out, minus the contribution of the held-out rows' own leverage, and its degrees of freedom are the runs'
    minus one.
    """
    columns, lows, highs = scaled_design(terms, ra, rg)
    gram_inverse: F64 = np.linalg.pinv(columns.T @ columns).astype(float)
    without, inverse = without_each_run(columns, target, run)
    place = np.unique(run, return_inverse=True)[1]
    errors = held_out_errors(columns, without, target, run)
    leverage = np.einsum("ni,nij,nj->n", columns, inverse[place], columns)
    model = RegressionModel(
        terms=terms,
        lows=lows[0],
        highs=highs[0],
        coefficients=gram_inverse @ columns.T @ target,
        gram_inverse=gram_inverse,
        residual_std=float(np.sqrt(np.mean(errors**2) / (1.0 + np.mean(leverage)))),
        dof=float(len(without) - 1),
    )
    others = zip(without, inverse, strict=True)
    return FittedRegression(model, tuple(replace(model, coefficients=b, gram_inverse=g) for b, g in others), errors)


def scaled_design(terms: tuple[str, ...], ra: F64, rg: F64) -> tuple[F64, F64, F64]:
    """Columns (..., n, p + 1) for indexes (..., n), scaled by their span: lows and highs (..., 1, p)."""
    raw = term_columns(terms, ra, rg)
    lows, highs = raw.min(axis=-2, keepdims=True), raw.max(axis=-2, keepdims=True)
    return scaled_columns(terms, ra, rg, lows, highs), lows, highs


def without_each_run(columns: F64, target: F64, run: I64) -> tuple[F64, F64]:
    """Coefficients (..., r, p) and inverse Gram matrices (..., r, p, p) of the fits without each run.

    columns (..., n, p): as many design matrices as there are leading dimensions, for one target (n,).
    """
    is_of_run = (run == np.unique(run)[:, None]).astype(float)
    grams = np.einsum("rn,...ni,...nj->...rij", is_of_run, columns, columns)
    slopes = np.einsum("rn,...ni,n->...ri", is_of_run, columns, target)
    rest = grams.sum(axis=-3, keepdims=True) - grams
    p = columns.shape[-1]
    ridge = RIDGE * np.trace(rest, axis1=-2, axis2=-1)[..., None, None] / p
    inverse = np.linalg.inv(rest + ridge * np.eye(p))
    without: F64 = np.einsum("...rij,...rj->...ri", inverse, slopes.sum(axis=-2, keepdims=True) - slopes)
    return without, inverse


def held_out_errors(columns: F64, without: F64, target: F64, run: I64) -> F64:
    """Errors (..., n) of every batch by the fit without its run; shapes as in :func:`without_each_run`."""
    place = np.unique(run, return_inverse=True)[1]
    errors: F64 = np.einsum("...ni,...ni->...n", columns, without[..., place, :]) - target
    return errors
