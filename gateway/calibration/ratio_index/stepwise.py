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
from gateway.calibration.ratio_index.regression import held_out_errors, without_each_run
from gateway.core.ratio_index.regression import scaled_columns, term_columns
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

    terms: tuple[str, ...]
    steps: tuple[Step, ...]


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
    library: tuple[str, ...],
    ra: F64,
    rg: F64,
    target: F64,
    run: I64,
    *,
    p_enter: float = P_ENTER,
    p_leave: float = P_LEAVE,
) -> Selection:
    """Forward selection from ``library`` with a look back after each step; ra, rg, target, run (n,).

    The best term enters while its p-value is under ``p_enter`` and it lowers the error on runs left out;
    one whose p-value rose above ``p_leave`` leaves. Tests are over run means, one a run. May choose nothing.
    """
    pool = _Pool(library, ra, rg, target, run)
    chosen: tuple[str, ...] = ()
    steps: list[Step] = []
    while len(chosen) < min(MAX_TERMS, pool.n_runs - 2):
        entering = pool.best_addition(chosen)
        if entering is None or not entering[1].p_value < p_enter:
            break
        term, test = entering
        rms = pool.held_out_rms((*chosen, term))
        if rms >= pool.held_out_rms(chosen):
            break
        chosen = (*chosen, term)
        steps.append(Step("enter", term, test, rms))
        term, test = max(((t, pool.test_of(t, chosen)) for t in chosen), key=lambda one: one[1].p_value)
        if test.p_value > p_leave and term != chosen[-1]:
            without = tuple(t for t in chosen if t != term)
            if pool.held_out_rms(without) <= rms:
                chosen = without
                steps.append(Step("leave", term, test, pool.held_out_rms(chosen)))
    return Selection(chosen, tuple(steps))


class _Pool:
    """All columns of a library: of batches, to be judged by runs left out, and of run means, to be tested."""

    def __init__(self, library: tuple[str, ...], ra: F64, rg: F64, target: F64, run: I64) -> None:
        raw = term_columns(library, ra, rg)
        self._place = {name: i for i, name in enumerate(library, 1)}
        self._batches = scaled_columns(library, ra, rg, raw.min(axis=0), raw.max(axis=0))
        self._target, self._run = target, run
        self._means = run_means(run, self._batches)
        self._target_means = run_means(run, target)

    @property
    def n_runs(self) -> int:
        return len(self._means)

    def best_addition(self, chosen: tuple[str, ...]) -> tuple[str, PartialF] | None:
        """The term whose addition leaves least, and its test; None where all depend on those chosen."""
        columns = self._means[:, self._places(chosen)]
        basis = np.linalg.qr(columns)[0]
        rest = self._means - basis @ (basis.T @ self._means)
        length = np.linalg.norm(rest, axis=0)
        is_new = length > INDEPENDENT * np.linalg.norm(self._means, axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = np.where(is_new, np.abs(rest.T @ self._target_means) / length, -1.0)
        best = int(np.argmax(gain))
        if gain[best] <= 0.0:
            return None
        name = next(name for name, place in self._place.items() if place == best)
        return name, partial_f(columns, self._means[:, [best]], self._target_means)

    def test_of(self, term: str, chosen: tuple[str, ...]) -> PartialF:
        """The test of one chosen term given the others."""
        others = tuple(name for name in chosen if name != term)
        return partial_f(self._means[:, self._places(others)], self._means[:, [self._place[term]]], self._target_means)

    def held_out_rms(self, chosen: tuple[str, ...]) -> float:
        columns = self._batches[:, self._places(chosen)]
        without, _ = without_each_run(columns, self._target, self._run)
        errors = held_out_errors(columns, without, self._target, self._run)
        return float(np.sqrt(np.mean(errors**2)))

    def _places(self, chosen: tuple[str, ...]) -> list[int]:
        return [0, *(self._place[name] for name in chosen)]


def _rss(columns: F64, target: F64) -> tuple[float, int]:
    """Sum of squared residuals, and the rank of the columns."""
    found, _, rank, _ = np.linalg.lstsq(columns, target, rcond=None)
    rest = target - columns @ found
    return float(rest @ rest), int(rank)
