"""How often alarms are right, and whether they are steady, for loads near a limit with errors as stated.

No vehicle is simulated. Each load's gross weight has a given distance from the limit in standard deviations of a batch;
half of each batch's error variance is its own, half is shared by all batches of the load. The errors pass through the
service's fusion and alarms. Whether real estimates have the stated errors is the subject of docs/coverage.md.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from statistics import median
from typing import Any, Final

import numpy as np

from benchmarks.accuracy.alarm_days import NEAR
from benchmarks.accuracy.markdown import Column, Row, page, table_of, text
from gateway.core.alarms.alarm import AlarmState
from gateway.core.alarms.rules import AlarmRules
from gateway.core.alarms.watch import AlarmWatch
from gateway.core.change import Rules
from gateway.core.fusion import epoch_of, fused_epoch
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import weighed
from gateway.estimate import Estimate
from gateway.posterior import Posterior, Source
from gateway.units import NS_PER_S

N_LOADS: Final = 500  # chosen: shares to 2 %
SEED: Final = 20290  # arbitrary
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


@dataclass(frozen=True, slots=True)
class Load:
    """The alarms of one load: the batches (from 1) of the first early and final step, and the number of alarms
    begun.
    """

    early: int | None
    final: int | None
    n_alarms: int


def alarms(n_loads: int, seed: int, on_line: Callable[[int, int], object] = lambda done, of: None) -> dict[str, Any]:
    """A line for each distance, with the same loads for both rules."""
    lines = []
    for distance in DISTANCES:
        drawn = np.random.default_rng([seed, round(10 * distance) + 1000]).standard_normal((n_loads, N_BATCHES + 1))
        found = [steps_of(AlarmRules(), distance, *_errors(row)) for row in drawn]
        jumpy = [steps_of(AlarmRules(clear_probability=WITHOUT_GAP), distance, *_errors(row)) for row in drawn]
        lines.append({"distance": distance, **_line(found), "n_alarms_without_gap": sum(one.n_alarms for one in jumpy)})
        on_line(len(lines), len(DISTANCES))
    return {"n_loads": n_loads, "seed": seed, "n_batches": N_BATCHES, "std_kg": STD_KG, "lines": lines}


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


def _line(loads: list[Load]) -> dict[str, Any]:
    early, final = ([n for n in (getattr(one, which) for one in loads) if n] for which in ("early", "final"))
    return {
        "n_early": len(early),
        "n_final": len(final),
        "median_early": median(early) if early else None,
        "median_final": median(final) if final else None,
        "n_alarms": sum(one.n_alarms for one in loads),
    }


def alarms_page(found: Mapping[str, Any]) -> str:
    """The page alarm_rules.md, from the numbers alone."""
    n_loads, rules = found["n_loads"], AlarmRules()
    return page(
        "Alarms: how often they are right",
        f"alarms --loads {n_loads} --seed {found['seed']} --output DIR",
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
