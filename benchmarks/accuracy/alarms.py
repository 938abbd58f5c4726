"""How often alarms are right, and whether they are steady: for loads near a limit, and on delivery days.

For loads near a limit no vehicle is simulated. Each load's gross weight has a given distance from the limit in standard
deviations of a batch; half of each batch's error variance is its own, half is shared by all batches of the load. The
errors pass through the service's fusion and alarms. Whether real estimates have the stated errors is the subject of
docs/coverage.md.

The payloads of simulated delivery days (delivery_days) are compared with several limits in turn, parts of the rated
payload. Each weighed leg counts by the state of the gross weight's alarm at its end.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import median
from typing import Any, Final

import numpy as np

from benchmarks.accuracy import delivery
from benchmarks.accuracy.delivery_days import Day, Said, day_of
from benchmarks.accuracy.drives import stated, van_of
from benchmarks.accuracy.markdown import Column, Row, page, table_of, text
from benchmarks.accuracy.study import Study
from gateway.core.alarms.alarm import AlarmState
from gateway.core.alarms.rules import AlarmRules
from gateway.core.alarms.watch import AlarmWatch
from gateway.core.change import Rules
from gateway.core.fusion import epoch_of, fused_epoch
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import weighed
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_from_json
from gateway.posterior import Posterior, Source
from gateway.units import NS_PER_S

N_LOADS: Final = 500  # chosen: shares to 2 %
SEED: Final = 20290  # arbitrary, of the loads
N_BATCHES: Final = 12  # chosen: of five minutes; an hour with one load
STD_KG: Final = 15.0  # chosen: of a batch
DISTANCES: Final = (-3.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 3.0)  # chosen: of the true weight, in STD_KG
WITHOUT_GAP: Final = 0.9  # a `clear_probability` equal to the early one
_BATCH_NS: Final = 300 * NS_PER_S  # BatchSettings.window_s
_LIMIT_PAYLOAD_KG: Final = 700.0  # chosen: of a small van
_VAN: Final = Vehicle(
    name="made up",
    empty_mass_kg=1600.0,
    wheelbase_m=3.0,
    sensor_position_m=0.0,
    unsprung_front_kg=100.0,
    unsprung_rear_kg=100.0,
    gross_limit_kg=1800.0 + _LIMIT_PAYLOAD_KG,
)
_RULES: Final = Rules(_LIMIT_PAYLOAD_KG, _VAN.empty_mass_kg + _LIMIT_PAYLOAD_KG)
_SHARE_STD_PCT: Final = 0.5  # chosen: has no effect on the gross weight
LIMITS: Final = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)  # chosen: of the rated payload
NEAR: Final = 0.1  # chosen, likewise
CLASSES: Final = ("far_over", "over", "under", "far_under")

End = tuple[str, str | None]  # the truth relative to the limit, and the alarm's state at the end of a leg


@dataclass(frozen=True, slots=True)
class Load:
    """The alarms of one load: the batches (from 1) of the first early and final step, and the number of alarms
    begun.
    """

    early: int | None
    final: int | None
    n_alarms: int


def numbers(seed: int, n: int, days: Sequence[Day]) -> dict[str, Any]:
    """The made-up loads, a line for each distance, and the delivery days."""
    return {
        "n_loads": N_LOADS,
        "n_batches": N_BATCHES,
        "std_kg": STD_KG,
        "lines": [_line(distance) for distance in DISTANCES],
        "days": on_days(seed, days),
    }


def _line(distance: float) -> dict[str, Any]:
    """The same loads for both rules."""
    drawn = np.random.default_rng([SEED, round(10 * distance) + 1000]).standard_normal((N_LOADS, N_BATCHES + 1))
    loads = [steps_of(AlarmRules(), distance, *_errors(row)) for row in drawn]
    jumpy = [steps_of(AlarmRules(clear_probability=WITHOUT_GAP), distance, *_errors(row)) for row in drawn]
    early, final = ([n for n in (getattr(one, which) for one in loads) if n] for which in ("early", "final"))
    return {
        "distance": distance,
        "n_early": len(early),
        "n_final": len(final),
        "median_early": median(early) if early else None,
        "median_final": median(final) if final else None,
        "n_alarms": sum(one.n_alarms for one in loads),
        "n_alarms_without_gap": sum(one.n_alarms for one in jumpy),
    }


def steps_of(rules: AlarmRules, distance: float, shared: float, own: list[float]) -> Load:
    """One load through fusion and alarms; errors are in standard deviations of a batch."""
    watch, epoch = AlarmWatch(replace(rules, off=("imbalance",)), "van"), None
    first: dict[AlarmState, int] = {}
    n_alarms = 0
    for n, error in enumerate(own, 1):
        batch = _batch(n, distance + shared + error)
        epoch = fused_epoch(epoch, batch, _RULES)
        assert epoch is not None
        batch = weighed(replace(batch, epoch=epoch_of(epoch.posterior, epoch.n_batches)), _VAN)
        for alarm in watch.weigh(batch, _VAN):
            first.setdefault(alarm.state, n)
            n_alarms += len(alarm.steps) == 1
    return Load(first.get(AlarmState.EARLY), first.get(AlarmState.FINAL), n_alarms)


def _errors(drawn: Any) -> tuple[float, list[float]]:
    half = math.sqrt(0.5)
    return half * float(drawn[0]), [half * float(one) for one in drawn[1:]]


def _batch(n: int, off: float) -> Estimate:
    half = math.sqrt(0.5) * np.array([STD_KG, _SHARE_STD_PCT])
    mean = np.array([_LIMIT_PAYLOAD_KG + STD_KG * off, 50.0])
    posterior = Posterior(mean, np.diag(half**2), {Source.MODEL: np.diag(half)})
    return Estimate(n * _BATCH_NS, (n + 1) * _BATCH_NS, "made up").answered(posterior)


def on_days(seed: int, days: Sequence[Day]) -> dict[str, Any]:
    """Legs over all days and limits, by the truth relative to the limit, and how many ended with an early or final
    alarm.
    """
    counts = Counter(leg for number, day in enumerate(days) for leg in legs_of(seed, number, day))
    return {
        "n_days": len(days),
        "seed": seed,
        "limits": list(LIMITS),
        "lines": [
            {
                "said": said.value,
                "truth": truth,
                "n": sum(n for (one, where, _), n in counts.items() if (one, where) == (said, truth)),
                "n_early": counts[said, truth, AlarmState.EARLY.value],
                "n_final": counts[said, truth, AlarmState.FINAL.value],
            }
            for said in Said
            for truth in CLASSES
        ],
    }


def legs_of(seed: int, number: int, driven: Day) -> list[tuple[Said, str, str | None]]:
    """The legs of one day for each limit."""
    vehicle = replace(stated(van_of(seed, number)), unsprung_front_kg=0.0, unsprung_rear_kg=0.0)
    return [
        (said, *leg)
        for said in Said
        for part in LIMITS
        for leg in _legs(driven, tuple(map(estimate_from_json, driven.records[said])), vehicle, part)
    ]


def _legs(driven: Day, estimates: tuple[Estimate, ...], vehicle: Vehicle, part: float) -> Iterator[End]:
    limit_kg = part * driven.rated_kg
    limited = replace(vehicle, gross_limit_kg=vehicle.empty_mass_kg + limit_kg)
    watch = AlarmWatch(AlarmRules(off=("imbalance", "sensor_fault", "no_estimate")), "van")
    ends: dict[int, str | None] = {}
    for estimate in estimates:
        watch.weigh(estimate, limited)
        if estimate.counted and not estimate.is_provisional:
            ends[delivery.leg_of(driven, estimate)] = next((alarm.state.value for alarm in watch.active()), None)
    for leg, state in ends.items():
        yield _truth((driven.payload_kg[leg] - limit_kg) / driven.rated_kg), state


def _truth(over: float) -> str:
    """The class of a payload that is ``over`` the limit, in parts of the rated payload."""
    if over > 0.0:
        return "far_over" if over > NEAR else "over"
    return "far_under" if over < -NEAR else "under"


def alarms_page(found: Mapping[str, Any]) -> str:
    """The page alarm_rules.md, from the numbers alone."""
    n_loads, rules = found["n_loads"], AlarmRules()
    return page(
        "Alarms: how often they are right",
        f"alarms --days {found['days']['n_days']} --seed {found['days']['seed']} --output DIR",
        f"{n_loads} made-up loads at each distance from a limit, each weighed in {found['n_batches']} batches. A "
        f"batch's standard deviation is {found['std_kg']:g} kg, half of its variance its own and half the load's, "
        "which does not average out. The rules are the settings' defaults: early from "
        f"{100 * rules.early_probability:g} %, final from {100 * rules.final_probability:g} % by "
        f"{rules.final_batches} batches, over at {100 * rules.clear_probability:g} %. Errors are as large as they "
        "stated; [coverage](coverage.md) says whether that is true of a vehicle.",
        "",
        *table_of(COLUMNS, ({**line, "n": n_loads} for line in found["lines"])),
        "",
        "Errors that the batches of a load share do not average out: a load at its limit, or a little under it, can be "
        "confirmed by an hour of batches that are all off the same way. Without a gap an alarm would end as soon "
        f"as its probability falls below {100 * WITHOUT_GAP:g} %, and start again.",
        "",
        *_days_section(found["days"]),
        "The rules: [alarms](alarms.md).",
        "",
    )


_WORDS: Final = {
    "far_over": "over it by more than {near:g} % of the rated payload",
    "over": "over it by less",
    "under": "under it by less",
    "far_under": "under it by more than {near:g} %",
}


def _days_section(days: Mapping[str, Any]) -> list[str]:
    limits = ", ".join(f"{100 * part:g}" for part in days["limits"])
    return [
        "## On delivery days",
        "",
        f"The {days['n_days']} simulated days of `python -m benchmarks.accuracy delivery`: vans that are not quite as "
        f"they were calibrated, eight stops, legs of one or two batches. Each day is held against limits of "
        f"{limits} % of the rated payload in turn; what counts is how the alarm of the gross weight stands at the end "
        "of each leg that was weighed.",
        "",
        *table_of(DAY_COLUMNS, days["lines"]),
        "",
        "What was confirmed stays so through later legs, until their load says no. Where nobody said what the vans "
        "carry, they may weigh too little "
        "([the shape of a load](method.md#weighing-gatewaycorecross_spectrumestimatorpy)); no rule of an alarm mends "
        "that.",
        "",
    ]


def _part(key: str) -> Callable[[Row], str]:
    return lambda row: f"{row[key]} ({100 * row[key] / max(row['n'], 1):.0f} %)"


def _no_alarm(row: Row) -> str:
    return _part("n_none")({**row, "n_none": row["n"] - row["n_early"] - row["n_final"]})


def _median(key: str) -> Callable[[Row], str]:
    return lambda row: "" if row[key] is None else f"{row[key]:g}"


COLUMNS: Final[tuple[Column, ...]] = (
    ("true weight over the limit, in standard deviations of a batch", lambda row: f"{row['distance']:+g}"),
    ("warned early", _part("n_early")),
    ("by batch (median)", _median("median_early")),
    ("confirmed", _part("n_final")),
    ("by batch (median)", _median("median_final")),
    ("alarms begun", text("n_alarms")),
    ("and without a gap between the limits of start and end", text("n_alarms_without_gap")),
)
DAY_COLUMNS: Final[tuple[Column, ...]] = (
    ("campaign says", lambda row: {"nothing": "nothing", "carries": "that it carries parcels"}[row["said"]]),
    ("the true payload is", lambda row: _WORDS[row["truth"]].format(near=100 * NEAR)),
    ("legs", text("n")),
    ("no alarm", _no_alarm),
    ("reported early", _part("n_early")),
    ("confirmed", _part("n_final")),
)


STUDY: Final = Study(
    name="alarms",
    does="Are alarms right, and are they steady? Made-up loads, and delivery days; ~25 s a day.",
    doing="driving delivery days",
    of_case=day_of,
    numbers=numbers,
    page=alarms_page,
    seed=delivery.SEED,
    n=delivery.N_DAYS,
    counts="days",
    least=1,
    file="alarm_rules",
    kept_as="day",
)
