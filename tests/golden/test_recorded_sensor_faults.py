"""A sample of `python -m benchmarks.accuracy faults`: recorded drives with faulty sensors mislead nobody."""

from pathlib import Path
from typing import Any

import pytest
from support.recordings import calibrated_with_roll_rate, recordings

from benchmarks.accuracy.faults import Drives, faults
from gateway.records import Why

NAMES = (
    "as recorded",
    "acceleration times",
    "pitch rate turned over",
    "pitch rate sent in rad/s for deg/s",
    "speed frozen",
    "two devices on one identifier",
    "frames doubled",
)
MOST_OUTSIDE = 0.5  # of a half-width, of either quantity: where an interval fails, it fails by little


@pytest.fixture(scope="module")
def drives() -> Drives:
    return Drives(recordings() / "mixed/campaign_roll.toml", calibrated_with_roll_rate(), runs=(3,), names=NAMES)


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("kept")


@pytest.fixture(scope="module")
def lines(drives: Drives, kept: Path) -> dict[tuple[str, str], dict[str, Any]]:
    return {(line["fault"], line["strength"]): line for line in faults(drives, kept=kept)["lines"]}


def test_every_batch_is_refused_or_held_or_nearly_so(lines: dict[tuple[str, str], dict[str, Any]]) -> None:
    assert {name for name, _ in lines} == {*NAMES}
    for line in lines.values():
        assert line["n_batches"] > 0
        assert line["n_refused"] + line["n_held"] <= line["n_batches"]
        assert max(line["payload_furthest"], line["front_share_furthest"]) <= MOST_OUTSIDE, line


def test_a_sound_drive_is_weighed(lines: dict[tuple[str, str], dict[str, Any]]) -> None:
    sound = lines["as recorded", ""]
    assert sound["n_held"] == sound["n_batches"] == 3


@pytest.mark.parametrize(
    ("fault", "strength", "why"),
    [
        ("acceleration times", "1.2", Why.GRAVITY_MISSING),
        ("pitch rate turned over", "", Why.WRONG_SIGN),
        ("speed frozen", "", Why.SPEED_FROZEN),
    ],
)
def test_a_fault_is_refused_for_what_it_is(
    lines: dict[tuple[str, str], dict[str, Any]], fault: str, strength: str, why: Why
) -> None:
    line = lines[fault, strength]
    assert line["n_refused"] == line["n_batches"]
    assert line["refused_by_reason"] == {str(why): line["n_batches"]}


def test_earlier_batches_are_not_weighed_again(
    drives: Drives, kept: Path, lines: dict[tuple[str, str], dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.accuracy.faults.estimates_of_logs", None)
    assert faults(drives, kept=kept)["lines"] == list(lines.values())
