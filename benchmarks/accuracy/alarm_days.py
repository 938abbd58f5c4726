"""Alarms on simulated delivery days (delivery_days) of vans that differ slightly from their calibration.

A day's payloads are compared with several limits in turn, parts of the rated payload. Each weighed leg counts by the
state of the gross weight's alarm at its end.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Final

from benchmarks.accuracy.delivery import leg_of
from benchmarks.accuracy.delivery_days import Day, Said
from benchmarks.accuracy.drives import stated, van_of
from gateway.core.alarms.alarm import AlarmState
from gateway.core.alarms.rules import AlarmRules
from gateway.core.alarms.watch import AlarmWatch
from gateway.core.vehicle import Vehicle
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_from_json

LIMITS: Final = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)  # chosen: of the rated payload
NEAR: Final = 0.1  # chosen, likewise
CLASSES: Final = ("far_over", "over", "under", "far_under")

End = tuple[str, str | None]  # the truth relative to the limit, and the alarm's state at the end of a leg


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
            ends[leg_of(driven, estimate)] = next((alarm.state.value for alarm in watch.active()), None)
    for leg, state in ends.items():
        yield _truth((driven.payload_kg[leg] - limit_kg) / driven.rated_kg), state


def _truth(over: float) -> str:
    """The class of a payload that is ``over`` the limit, in parts of the rated payload."""
    if over > 0.0:
        return "far_over" if over > NEAR else "over"
    return "far_under" if over < -NEAR else "under"
