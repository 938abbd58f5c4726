"""What every room shows of an estimate: instants, identities, nulls."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Epoch, Estimate, Quantity
from gateway.records import Why, iso_utc, json_line

FULL = Estimate(
    t_start_ns=1_790_000_000_000_000_000,
    t_end_ns=1_790_000_300_000_000_000,
    estimator="ratio_index",
    calibration_id="sha256:1",
    payload=Quantity(271.3, 6.1, (259.3, 283.3)),
    vehicle_id="van-17",
)


@pytest.mark.parametrize(
    ("t_ns", "said"),
    [
        (0, "1970-01-01T00:00:00.000000Z"),
        (1_790_000_000_123_456_789, "2026-09-21T14:13:20.123456Z"),
        (999, "1970-01-01T00:00:00.000000Z"),
    ],
)
def test_instants_are_utc_with_microseconds(t_ns: int, said: str) -> None:
    assert iso_utc(t_ns) == said


def test_unknown_is_null_and_known_is_a_number() -> None:
    shown = estimate_to_json(FULL)
    assert (shown["payload_kg"], shown["payload_interval95_kg"]) == (271.3, [259.3, 283.3])
    assert (shown["front_share_pct"], shown["front_share_interval95_pct"]) == (None, None)
    assert "vin" not in shown
    assert "provisional" not in shown
    assert estimate_to_json(replace(FULL, is_provisional=True))["provisional"] is True
    assert estimate_to_json(replace(FULL, epoch=Epoch(Quantity(270.0), Quantity(), 1)))["epoch_payload_kg"] == 270.0


@given(payload_kg=st.floats())
def test_any_number_is_json(payload_kg: float) -> None:
    line = json_line(estimate_to_json(replace(FULL, payload=Quantity(payload_kg))))
    assert "\n" not in line
    again = json.loads(line)["payload_kg"]
    assert again == pytest.approx(payload_kg, rel=1e-8) if np.isfinite(payload_kg) else again is None


def test_the_id_depends_on_the_input_and_not_on_the_answer() -> None:
    assert replace(FULL, payload=Quantity(0.0), rejected=(Why.TOO_SLOW,)).id == FULL.id
    changes = [
        {"vehicle_id": "van-18"},
        {"estimator": "x"},
        {"calibration_id": None},
        {"t_start_ns": 1},
        {"t_end_ns": 2},
    ]
    assert len({FULL.id, *(replace(FULL, **other).id for other in changes)}) == 6
