"""Regressors chosen one by one by partial F-tests, each also held against runs left out.

The p-value of a regressor fixed beforehand is uniform where that regressor does nothing. Of one picked as
the best of many it is not: the smallest of many p-values is small by choice alone. P-values of a stepwise
selection therefore rank and stop, and prove nothing; what was selected is believed as far as runs that
took no part in the selection confirm it.
"""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from scipy.special import fdtrc

from gateway.calibration.ratio_index.bands import run_means
from gateway.calibration.ratio_index.regression import held_out_errors, scaled_design, without_each_run
from gateway.records import F64, I64

P_ENTER: Final = 0.05
P_LEAVE: Final = 0.10
MAX_TERMS: Final = 4  # as many as (11) has
INDEPENDENT: Final = 1e-5  # of a column's norm that must be left when those already chosen are taken out


@dataclass(frozen=True, slots=True)
class PartialF:
    """F = ((RSS without - RSS with) / added) / (RSS with / dof), and the chance of a larger one."""

    statistic: float
    p_value: float
    dof: int


@dataclass(frozen=True, slots=True)
class Step:
    """One term that came or went, its test, and the root mean square error on runs left out after it."""

    action: Literal["enter", "leave"]
    term: str
    test: PartialF
    held_out_rms: float


@dataclass(frozen=True, slots=True)
class Selection:
    """The terms chosen and how; the p-values are those at the time of each step and are not uniform."""

    terms: tuple[str, ...] = ()
    steps: tuple[Step, ...] = ()


def partial_f(columns: F64, added: F64, target: F64) -> PartialF:
    """Does ``added`` (n, k) tell of ``target`` (n,) what ``columns`` (n, p), the constant among them, do not?

    The textbook test of nested least-squares models (Draper and Smith, Applied Regression Analysis, ch. 6);
    rows must be independent, so give run means. F and p are NaN where ``added`` adds nothing
    or no degree of freedom is left.
    """
    less, rank_less = _rss(columns, target)
    full, rank_full = _rss(np.column_stack([columns, added]), target)
    n_added, dof = rank_full - rank_less, len(target) - rank_full
    if dof < 1 or n_added < 1:
        return PartialF(float("nan"), float("nan"), dof)
    statistic = float("inf") if full == 0.0 else (less - full) / n_added / (full / dof)
    return PartialF(statistic, float(fdtrc(n_added, dof, statistic)), dof)


def select_stepwise(
    library: tuple[str, ...], ra: F64, rg: F64, target: F64, run: I64, *, p_enter: float = P_ENTER
) -> Selection:
    """Forward selection from ``library`` with a look back after each step; ra, rg, target, run (n,).

    The best term enters while its p-value is under ``p_enter`` and it lowers the error on runs left out; one
    whose p-value rose above P_LEAVE leaves where that costs no such error. Tests are over run means, one a
    run. May choose nothing.
    """
    batches, _, _ = scaled_design(library, ra, rg)
    means, aim = run_means(run, batches), run_means(run, target)

    def held_out_rms(chosen: list[int]) -> float:
        columns = batches[:, chosen]
        errors = held_out_errors(columns, without_each_run(columns, target, run)[0], target, run)
        return float(np.sqrt(np.mean(errors**2)))

    chosen = [0]  # columns: the constant, then the library's
    rms = held_out_rms(chosen)
    steps: list[Step] = []
    while len(chosen) <= min(MAX_TERMS, len(means) - 2):
        new = _best_addition(means, aim, chosen)
        if new is None:
            break
        test, longer_rms = partial_f(means[:, chosen], means[:, [new]], aim), held_out_rms([*chosen, new])
        if not test.p_value < p_enter or longer_rms >= rms:
            break
        chosen, rms = [*chosen, new], longer_rms
        steps.append(Step("enter", library[new - 1], test, rms))
        rest = {old: [other for other in chosen if other != old] for old in chosen[1:]}
        tests = {old: partial_f(means[:, others], means[:, [old]], aim) for old, others in rest.items()}
        weakest = max(tests, key=lambda old: tests[old].p_value)
        if tests[weakest].p_value > P_LEAVE and weakest != new:
            shorter_rms = held_out_rms(rest[weakest])
            if shorter_rms <= rms:
                chosen, rms = rest[weakest], shorter_rms
                steps.append(Step("leave", library[weakest - 1], tests[weakest], rms))
    return Selection(tuple(library[column - 1] for column in chosen[1:]), tuple(steps))


def _best_addition(means: F64, aim: F64, chosen: list[int]) -> int | None:
    """The column of means (r, p) whose addition leaves least of aim (r,); None where all depend on those chosen."""
    basis = np.linalg.qr(means[:, chosen])[0]
    rest = means - basis @ (basis.T @ means)
    length = np.linalg.norm(rest, axis=0)
    is_new = length > INDEPENDENT * np.linalg.norm(means, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = np.where(is_new, np.abs(rest.T @ aim) / length, -1.0)
    best = int(np.argmax(gain))
    return best if gain[best] > 0.0 else None


def _rss(columns: F64, target: F64) -> tuple[float, int]:
    """Sum of squared residuals, and the rank of the columns."""
    coefficients, _, rank, _ = np.linalg.lstsq(columns, target, rcond=None)
    rest = target - columns @ coefficients
    return float(rest @ rest), int(rank)
