"""The study of false statements: which kinds are refused before any fit, and what its table says of the others."""

import pytest
from support.paper_van import paper_van

from benchmarks.accuracy.false_statements import (
    KINDS,
    STEADY,
    TEACH,
    Kind,
    Recorded,
    recorded_of,
    stated,
    told_by,
)
from gateway.calibration.assigned import Fate
from gateway.calibration.known_run import KnownRun
from gateway.core.vehicle import front_share_pct

VAN = paper_van(sensor_position_m=3.2, payload_range_kg=(0.0, 450.0))
LOADS = ((358.5, 2.179), (130.4, 1.859), (306.0, 2.867), (0.0, 1.0), (172.9, 2.907), (436.4, 1.989), (207.6, 0.959),
         (396.8, 2.241))  # fmt: skip
REFUSED = {
    "note of another year": "no drive within 12 hours of 2025-03-05",
    "gross for net": "write gross_kg",
    "net for gross": "write payload_kg",
    "pounds: 961 for 436 kg": "is it in pounds",
    "tonnes": "if these are tonnes",
    "place in centimetres": "behind_front_axle_m: Input should be less than or equal to 30",
    "two notes for one load, half each": "of the same time as",
}


def run(number: int, payload_kg: float, position_m: float) -> KnownRun:
    return KnownRun(number, f"run {number}", payload_kg, front_share_pct(VAN, payload_kg, position_m), ())


@pytest.fixture
def recorded() -> Recorded:
    mixed = [run(number, *load) for number, load in enumerate(LOADS, 2)]
    return recorded_of(VAN, run(1, 0.0, 1.0), mixed)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.title)
def test_a_statement_that_cannot_be_true_is_refused_before_any_fit(recorded: Recorded, kind: Kind) -> None:
    found = stated(told_by(kind, recorded), (STEADY, *TEACH), recorded.vehicle)
    of_false = [
        (fate, reason)
        for (drive, _), fate, reason in zip(found.records, found.assigned.fates, found.assigned.reasons, strict=True)
        if drive in kind.false
    ]
    of_false += [(Fate.IMPOSSIBLE, fault) for fault in found.faults]
    others = [
        fate for (drive, _), fate in zip(found.records, found.assigned.fates, strict=True) if drive not in kind.false
    ]
    assert set(others) <= {Fate.MATCHED}
    if kind.title in REFUSED:
        assert of_false
        assert all(fate is not Fate.MATCHED and REFUSED[kind.title] in reason for fate, reason in of_false)
    else:
        assert all(fate is Fate.MATCHED for fate, _ in of_false)
