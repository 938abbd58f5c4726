"""Are load events found, and are any reported without a change? Delivery days, processed batch by batch like the
service.
"""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.delivery_days import Day as DrivenDay
from benchmarks.accuracy.delivery_days import Said, day_of
from benchmarks.accuracy.drives import stated, van_of
from benchmarks.accuracy.markdown import Column, Row, page, part_cell, score_cell, table_of, text
from benchmarks.accuracy.study import Study
from gateway.calibration.judgement.coverage import interval_scores
from gateway.core.change import Rules
from gateway.core.events.day import Day
from gateway.core.events.entry import Entry, EntryKind
from gateway.core.events.ledger import Ledger
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


Weighed = tuple[float, float, float, bool]
"""A counted batch in percent of the rated payload: its error, half its 95 % interval, its score; and whether the
interval contains the truth.
"""


@dataclass(frozen=True, slots=True)
class JudgedDay:
    """One simulated day with its judged events."""

    changes: list[Change]
    trips: list[Carried]
    n_revisions: int
    batches: list[Weighed]


def numbers(seed: int, n: int, days: Sequence[DrivenDay]) -> dict[str, Any]:
    """Judge the days."""
    judged = [judged_day(seed, number, day) for number, day in enumerate(days)]
    return {
        "seed": seed,
        "vans": [day.van for day in days],
        "said": {said: _told_of([day[said] for day in judged]) for said in Said},
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


def judged_day(seed: int, number: int, driven: DrivenDay) -> dict[Said, JudgedDay]:
    """One day's truth and reports, for each statement of the campaign."""
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
    return JudgedDay(changes, trips, n_revisions, weighed)


def _weighed(estimate: Estimate, driven: DrivenDay) -> Weighed:
    payload_kg = driven.payload_kg[leg_of(driven, estimate)]
    low, high = estimate.payload.interval95
    percent = 100.0 / driven.rated_kg
    (score_kg,) = interval_scores(np.array([payload_kg]), np.array([low]), np.array([high])).tolist()
    error_kg, is_held = estimate.payload.number - payload_kg, low <= payload_kg <= high
    return percent * error_kg, percent * 0.5 * (high - low), percent * score_kg, is_held


def _batches(weighed: Sequence[Weighed]) -> dict[str, Any]:
    error, half_width, score, is_held = np.array(weighed).T
    return {
        "n": len(weighed),
        "mean_abs_pct": _rounded(float(np.mean(np.abs(error)))),
        "bias_pct": _rounded(float(np.mean(error))),
        "half_width_pct": _rounded(float(np.mean(half_width))),
        "interval_score_pct": _rounded(float(np.mean(score))),
        "n_held": int(np.sum(is_held)),
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


ROWS: Final = (
    ("true_above_5_std", "true change above 5 standard deviations"),
    ("true_3_to_5_std", "true change of 3 to 5"),
    ("true_below_3_std", "true change below 3"),
    ("found_above_3_std", "of all these, measured above 3"),
    ("stops_without_change", "stop without a change"),
    ("under_way", "between two batches of one drive"),
)


def _held(row: Row) -> str:
    return part_cell(row["n_held"], row["n"])


FOUND: Final[tuple[Column, ...]] = (
    ("What lay between two weighings", text("words")),
    ("how often", text("n")),
    ("reported as an event", text("n_told")),
)
KILOGRAMS: Final[tuple[Column, ...]] = (
    ("Changes reported", text("n")),
    ("mean abs. error", lambda row: f"{row['mean_abs_kg']:.1f} kg"),
    ("of the change", lambda row: f"{row['mean_abs_pct']:.0f} %"),
    ("bias", lambda row: f"{row['bias_kg']:+.1f} kg"),
    ("stated std (mean)", lambda row: f"{row['mean_std_kg']:.1f} kg"),
    ("mean z squared", lambda row: f"{row['mean_z2']:.2f}"),
    ("within 95 % interval", _held),
)
BATCHES: Final[tuple[Column, ...]] = (
    ("campaign says", text("words")),
    ("batches", text("n")),
    ("mean abs. error", lambda row: f"{row['mean_abs_pct']:.1f} %"),
    ("bias", lambda row: f"{row['bias_pct']:+.1f} %"),
    ("+- (mean)", lambda row: f"{row['half_width_pct']:.1f} %"),
    ("interval score", lambda row: score_cell(row["interval_score_pct"], row["mean_abs_pct"])),
    ("within 95 % interval", _held),
)
SAID: Final = ((Said.NOTHING, "nothing"), (Said.CARRIES, "that it carries parcels"))


def delivery_page(found: Mapping[str, Any]) -> str:
    """The page in Markdown."""
    said = found["said"][Said.CARRIES]
    kg, trips, told = said["kg"], said["trips"], said["found"]
    n_invented = told["stops_without_change"]["n_told"] + told["under_way"]["n_told"]
    plain = told["found_above_3_std"]
    return page(
        "Load events: how well they are found",
        f"delivery --seeds {len(found['vans'])} --seed {found['seed']} --output DIR",
        f"{len(found['vans'])} simulated delivery days, each of another van that was not used to choose any "
        f"setting. It is "
        "calibrated on six known loads, its campaign says that it carries parcels, and it is "
        "a little another one on its day: worn, warm, on other tyres. It leaves empty and makes 8 "
        "stops: loading, four deliveries, one pick-up, and two at which nothing happens. "
        "Legs last five to fifteen minutes, in town and in the country, on roads of changing roughness. The bus "
        "sleeps at stops and no door is mapped, so that only the weight shows what happened. Events are judged by "
        "their last revision, batch by batch as the service makes them.",
        "",
        "## Found, and invented",
        "",
        "Standard deviations are those that the event states.",
        "",
        *table_of(FOUND, ({"words": words, **told[name]} for name, words in ROWS)),
        "",
        f"Of {plain['n']} changes that were measured above three standard deviations, {plain['n_told']} were reported; "
        f"{n_invented} events were invented. Half of the changes of exactly three standard deviations are measured "
        "as less: they cannot all be found without inventing others.",
        "",
        "## Kilograms",
        "",
        *table_of(KILOGRAMS, [kg]),
        "",
        "Where two stops lie between weighings, the change is that of both together.",
        "",
        "## The shape of the load",
        "",
        "These vans were calibrated with each load in one place; their parcels lie all along the floor, and some "
        "are high. Unless the campaign states what the vehicle carries (`carries`), the prior gives half of all loads "
        "the shape of the known ones. "
        "([method](method.md#weighing-gatewaycorecross_spectrumestimatorpy)). Batches by themselves, in percent "
        "of the rated payload; the interval score is the width of the 95 % interval and 40 times what the truth "
        "lies outside, in brackets what it would be for normal errors and intervals of the right width:",
        "",
        *table_of(BATCHES, ({"words": words, **found["said"][said]["batches"]} for said, words in SAID)),
        "",
        "## Trips",
        "",
        f"{trips['n']} trips with a known load: {trips['told_tkm']:.1f} tonne-kilometres reported, "
        f"{trips['true_tkm']:.1f} true; {part_cell(trips['n_held'], trips['n'])} within their 95 % intervals; the "
        f"distance, by the receiver's speed, {trips['mean_abs_distance_pct']:.1f} % off in the mean.",
        "",
        "What an event is and how its probability is found: "
        "[method](method.md#load-events-and-trips-gatewaycoreevents).",
        "",
    )


STUDY: Final = Study(
    name="delivery",
    does="Are load events found, and are any reported without a change? Simulated delivery days of vans; ~25 s a day.",
    doing="driving delivery days",
    of_case=day_of,
    numbers=numbers,
    page=delivery_page,
    seed=SEED,
    n=N_DAYS,
    counts="seeds",
    least=1,
    file="events",
    kept_as="day",
)
