"""Are load events found, and are any reported without a change? Delivery days, processed batch by batch like the
service.

    delivery(n_days, seed) -> numbers for events.json
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.coverage_drives import stated
from benchmarks.accuracy.delivery_days import Day as DrivenDay
from benchmarks.accuracy.delivery_days import Said, kept_day
from benchmarks.accuracy.runner import OnDone, run_each
from benchmarks.accuracy.vans import van_of
from gateway.calibration.judgement.coverage import interval_scores
from gateway.core.change import Rules
from gateway.core.events import Entry, EntryKind, Ledger
from gateway.core.events.day import Day
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_from_json

SEED: Final = 20_280  # arbitrary, of this study alone
N_DAYS: Final = 20  # chosen: some 150 changes
PLAIN: Final = 3.0  # standard deviations, as core.events.ledger.PLAIN_STDS


@dataclass(frozen=True, slots=True)
class Change:
    """A pair of consecutive weighings: the true and the estimated change, and whether it was reported in the end."""

    day: int
    true_kg: float
    change_kg: float
    std_kg: float
    probability: float
    is_told: bool
    is_stop: bool

    @property
    def is_change(self) -> bool:
        return self.true_kg != 0.0

    @property
    def true_stds(self) -> float:
        return abs(self.true_kg) / self.std_kg

    @property
    def found_stds(self) -> float:
        return abs(self.change_kg) / self.std_kg

    @property
    def is_held(self) -> bool:
        return abs(self.change_kg - self.true_kg) <= 1.959964 * self.std_kg


@dataclass(frozen=True, slots=True)
class Carried:
    """A trip's tonne-kilometres: true and reported."""

    day: int
    true_tkm: float
    told_tkm: float
    std_tkm: float
    true_m: float
    told_m: float


@dataclass(frozen=True, slots=True)
class Weighed:
    """A counted batch, in percent of the rated payload: its error, half its 95 % interval, and its score."""

    error_pct: float
    half_width_pct: float
    score_pct: float
    is_held: bool


@dataclass(frozen=True, slots=True)
class JudgedDay:
    """One simulated day with its judged events."""

    van: str
    changes: list[Change]
    trips: list[Carried]
    n_revisions: int
    batches: list[Weighed]


def delivery(
    n_days: int, seed: int = SEED, *, workers: int = 1, kept: Path | None = None, on_day: OnDone = lambda done, of: None
) -> dict[str, Any]:
    """Simulate and judge the days."""
    days = list(run_each(partial(judged_day, kept, seed), n_days, workers, on_day))
    return {
        "seed": seed,
        "vans": [day[Said.NOTHING].van for day in days],
        "said": {said: _told_of([day[said] for day in days]) for said in Said},
    }


def _told_of(days: Sequence[JudgedDay]) -> dict[str, Any]:
    changes = [one for day in days for one in day.changes]
    trips = [one for day in days for one in day.trips]
    return {
        "found": _found(changes),
        "kg": _errors([one for one in changes if one.is_change and one.is_told]),
        "trips": _trips(trips),
        "n_revisions": sum(day.n_revisions for day in days),
        "batches": _batches([one for day in days for one in day.batches]),
        "changes": [asdict(one) for one in changes],
    }


def judged_day(kept: Path | None, seed: int, number: int) -> dict[Said, JudgedDay]:
    """One day's truth and reports, for each statement of the campaign."""
    driven = kept_day(kept, seed, number)
    rules = Rules.of(stated(van_of(seed, number)))
    return {said: _judged(number, driven, tuple(map(estimate_from_json, driven.records[said])), rules) for said in Said}


def _judged(number: int, driven: DrivenDay, estimates: tuple[Estimate, ...], rules: Rules) -> JudgedDay:
    ledger, last, n_revisions = Ledger(rules), dict[str, Entry](), 0
    for estimate in estimates:
        for entry in ledger.add(estimate):
            last[entry.id] = entry
            n_revisions += 1
    changes = list(_changes(number, driven, Day(estimates, rules), last))
    trips = [
        _carried(number, driven, entry)
        for entry in last.values()
        if entry.kind is EntryKind.TRIP and entry.record["carried_tkm"] is not None
    ]
    weighed = [_weighed(one, driven) for one in estimates if one.counted]
    return JudgedDay(driven.van, changes, trips, n_revisions, weighed)


def _weighed(estimate: Estimate, driven: DrivenDay) -> Weighed:
    payload_kg = driven.payload_kg[leg_of(driven, estimate)]
    low, high = estimate.payload.interval95
    percent = 100.0 / driven.rated_kg
    (score_kg,) = interval_scores(np.array([payload_kg]), np.array([low]), np.array([high])).tolist()
    return Weighed(
        percent * (estimate.payload.number - payload_kg),
        percent * 0.5 * (high - low),
        percent * score_kg,
        low <= payload_kg <= high,
    )


def _batches(weighed: Sequence[Weighed]) -> dict[str, Any]:
    errors = np.array([one.error_pct for one in weighed])
    return {
        "n": len(weighed),
        "mean_abs_pct": _rounded(float(np.mean(np.abs(errors)))),
        "bias_pct": _rounded(float(np.mean(errors))),
        "half_width_pct": _rounded(float(np.mean([one.half_width_pct for one in weighed]))),
        "interval_score_pct": _rounded(float(np.mean([one.score_pct for one in weighed]))),
        "n_held": sum(one.is_held for one in weighed),
    }


def _changes(number: int, driven: DrivenDay, day: Day, last: Mapping[str, Entry]) -> Iterator[Change]:
    legs = [leg_of(driven, day.estimates[weighing.at]) for weighing in day.weighings]
    for i, entry in enumerate(day.events()):
        told = last.get(entry.id)
        is_told = told is not None and not told.record["is_withdrawn"]
        record = told.record if told is not None and is_told else entry.record
        yield Change(
            number,
            driven.payload_kg[legs[i + 1]] - driven.payload_kg[legs[i]],
            record["change_kg"],
            record["change_std_kg"],
            record["probability"],
            is_told,
            legs[i] != legs[i + 1],
        )


def leg_of(driven: DrivenDay, estimate: Estimate) -> int:
    return bisect_right(driven.leg_start_ns, estimate.t_start_ns + 1_000_000_000) - 1


def _carried(number: int, driven: DrivenDay, entry: Entry) -> Carried:
    t_end_ns = entry.t_end_ns
    leg = bisect_right(driven.leg_start_ns, t_end_ns) - 1
    true_m, told = driven.distance_m[leg], entry.record
    return Carried(
        number, driven.payload_kg[leg] * true_m / 1e6, told["carried_tkm"], told["carried_std_tkm"], true_m,
        told["distance_m"],
    )  # fmt: skip


def _found(changes: Sequence[Change]) -> dict[str, Any]:
    def told(chosen: Callable[[Change], bool]) -> dict[str, int]:
        some = [one for one in changes if chosen(one)]
        return {"n": len(some), "n_told": sum(one.is_told for one in some)}

    return {
        "true_below_3_std": told(lambda one: one.is_change and one.true_stds < PLAIN),
        "true_3_to_5_std": told(lambda one: one.is_change and PLAIN <= one.true_stds < 5.0),
        "true_above_5_std": told(lambda one: one.is_change and one.true_stds >= 5.0),
        "found_above_3_std": told(lambda one: one.is_change and one.found_stds >= PLAIN),
        "stops_without_change": told(lambda one: not one.is_change and one.is_stop),
        "under_way": told(lambda one: not one.is_change and not one.is_stop),
    }


def _errors(told: Sequence[Change]) -> dict[str, Any]:
    errors = np.array([one.change_kg - one.true_kg for one in told])
    return {
        "n": len(told),
        "mean_abs_kg": _rounded(float(np.mean(np.abs(errors)))),
        "bias_kg": _rounded(float(np.mean(errors))),
        "rms_kg": _rounded(float(np.sqrt(np.mean(errors**2)))),
        "mean_std_kg": _rounded(float(np.mean([one.std_kg for one in told]))),
        "mean_z2": _rounded(float(np.mean([(one.change_kg - one.true_kg) ** 2 / one.std_kg**2 for one in told]))),
        "mean_abs_pct": _rounded(100.0 * float(np.mean([abs(one.change_kg / one.true_kg - 1.0) for one in told]))),
        "n_held": sum(one.is_held for one in told),
    }


def _trips(trips: Sequence[Carried]) -> dict[str, Any]:
    true, told = math.fsum(one.true_tkm for one in trips), math.fsum(one.told_tkm for one in trips)
    return {
        "n": len(trips),
        "true_tkm": _rounded(true),
        "told_tkm": _rounded(told),
        "n_held": sum(abs(one.told_tkm - one.true_tkm) <= 1.959964 * one.std_tkm for one in trips),
        "mean_abs_distance_pct": _rounded(
            100.0 * float(np.mean([abs(one.told_m / one.true_m - 1.0) for one in trips]))
        ),
    }


def _rounded(x: float) -> float:
    return round(x, 3)
