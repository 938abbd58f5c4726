"""What a regression's residuals and columns say against it."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import stats

from gateway.calibration.ratio_index.regression import FittedRegression
from gateway.core.ratio_index.regression import scaled_columns
from gateway.records import F64, I64

SUSPICIOUS_P: Final = 0.01
MOST_VIF: Final = 10.0  # the usual limit: Draper and Smith, Applied Regression Analysis, ch. 16


@dataclass(frozen=True, slots=True)
class Diagnostics:
    """Few and meaningful; p-values are small where the assumption is doubtful, None where there is nothing to test.

    normality_p: Shapiro and Wilk's test of the residuals. run_effect_p: do the residuals of a run resemble
    each other (analysis of variance, exact where the indexes differ between runs only)? Then errors do not
    average out within a run. spread_p: Breusch and Pagan's test (Koenker's form), does the squared residual
    change with the fitted value? vif: variance inflation of each term by the others; condition_number of
    the columns at unit length. High ones make single coefficients meaningless, not the prediction.
    """

    normality_p: float | None
    run_effect_p: float | None
    spread_p: float | None
    vif: dict[str, float]
    condition_number: float

    @property
    def warnings(self) -> tuple[str, ...]:
        """In words, what a reader must know."""
        found = []
        if self.run_effect_p is not None and self.run_effect_p < SUSPICIOUS_P:
            found.append("errors differ between runs more than within them: a longer drive does not average them out")
        if self.spread_p is not None and self.spread_p < SUSPICIOUS_P:
            found.append("the spread changes with the load: intervals are too wide at one end, too narrow at the other")
        if self.normality_p is not None and self.normality_p < SUSPICIOUS_P:
            found.append("the residuals are not Gaussian: look for a drive that stands apart")
        collinear = [name for name, vif in self.vif.items() if vif > MOST_VIF]
        if collinear:
            found.append(f"{', '.join(collinear)} nearly repeat one another: read no meaning into their coefficients")
        return tuple(found)


def diagnose(fitted: FittedRegression, ra: F64, rg: F64, target: F64, run: I64) -> Diagnostics:
    """Of the regression on ra, rg, target and run (n,) that it was fitted on."""
    model = fitted.model
    columns = scaled_columns(model.terms, ra, rg, model.lows, model.highs)
    unit = columns / np.linalg.norm(columns, axis=0)
    is_exact = np.allclose(fitted.residuals, 0.0, atol=1e-9 * np.ptp(target))
    return Diagnostics(
        normality_p=None if is_exact or len(target) < 3 else float(stats.shapiro(fitted.residuals).pvalue),
        run_effect_p=None if is_exact else _run_effect(fitted.residuals, run, columns.shape[1]),
        spread_p=None if is_exact else _breusch_pagan(columns @ model.coefficients, fitted.residuals),
        vif={name: _vif(columns, i) for i, name in enumerate(model.terms, 1)},
        condition_number=float(np.linalg.cond(unit)),
    )


def _run_effect(residuals: F64, run: I64, n_columns: int) -> float | None:
    """One-way analysis of variance; the fit has taken ``n_columns`` degrees of freedom from between the runs."""
    numbers, place, counts = np.unique(run, return_inverse=True, return_counts=True)
    between_dof, within_dof = len(numbers) - n_columns, len(run) - len(numbers)
    if between_dof < 1 or within_dof < 1:
        return None
    means = np.bincount(place, residuals) / counts
    within = float(np.sum((residuals - means[place]) ** 2)) / within_dof
    return float(stats.f.sf(counts @ means**2 / between_dof / within, between_dof, within_dof))


def _breusch_pagan(fit: F64, residuals: F64) -> float:
    """n R^2 of the squared residuals on the fitted values is chi-square with one degree of freedom (Koenker 1981)."""
    correlation = np.corrcoef(fit, residuals**2)[0, 1]
    return float(stats.chi2.sf(len(fit) * correlation**2, 1))


def _vif(columns: F64, i: int) -> float:
    """1 / (1 - R^2) of one column on the others, the constant among them."""
    others = np.delete(columns, i, axis=1)
    rest = columns[:, i] - others @ np.linalg.lstsq(others, columns[:, i], rcond=None)[0]
    own = columns[:, i] - columns[:, i].mean()
    with np.errstate(divide="ignore"):
        return float(np.divide(own @ own, rest @ rest))
