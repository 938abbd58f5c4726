"""What the alarms say on simulated delivery days (delivery_days): of vans that are not quite as they were calibrated.

A day's payloads are held against several limits in turn, parts of the rated payload. What counts is how the alarm of
the gross weight stands at the end of each leg that was weighed.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from benchmarks.accuracy.coverage_drives import stated
from benchmarks.accuracy.delivery import leg_of
from benchmarks.accuracy.delivery_days import Day, Said, kept_day
from benchmarks.accuracy.vans import OnVan, of_each_van, van_of
from gateway.core.alarms import AlarmRules, AlarmState, AlarmWatch
from gateway.core.vehicle import Vehicle
from gateway.estimate import Estimate
from gateway.estimate_json import estimate_from_json

LIMITS: Final = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)  # of the rated payload
NEAR: Final = 0.1  # likewise
CLASSES: Final = ("far_over", "over", "under", "far_under")

End = tuple[str, str | None]  # how the truth lies to the limit, and what the alarm says at a leg's end


def days(n_days: int, seed: int, *, workers: int = 1, kept: Path | None = None, on_day: OnVan) -> dict[str, Any]:
    """Of all days and limits: legs by where the truth lies, and how many ended with an alarm, early or confirmed."""
    legs = [leg for day in of_each_van(partial(legs_of, kept, seed), n_days, workers, on_day) for leg in day]
    counts = Counter(legs)
    return {
        "n_days": n_days,
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


def legs_of(kept: Path | None, seed: int, number: int) -> list[tuple[Said, str, str | None]]:
    """One day against each limit."""
    driven = kept_day(kept, seed, number)
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
    """``over`` the limit, in parts of the rated payload."""
    if over > 0.0:
        return "far_over" if over > NEAR else "over"
    return "far_under" if over < -NEAR else "under"
