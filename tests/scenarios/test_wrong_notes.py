"""A wrong delivery note among right ones is held and asked about, and no right one is accused."""

from pathlib import Path
from typing import Any

import pytest
from support.half_car_road import VAN
from support.known_load_logs import SIGNALS, START_NS, write_known_loads

from gateway.bus.signals import load_signal_map
from gateway.calibration.assigned import moments
from gateway.calibration.learning.from_pieces import learn, matched
from gateway.calibration.learning.spans import standing
from gateway.calibration.learning.told import statements_record
from gateway.core.batch_settings import BatchSettings
from gateway.offline.drives_of_logs import read_drives
from gateway.records import iso_utc
from gateway.stated.statement import StatementRecord

SETTINGS = BatchSettings(window_s=100.0)
LOADS = ((0.0, None), (300.0, 1.4), (150.0, 1.8), (400.0, 1.6), (250.0, 2.0))


def note(number: int, payload_kg: float) -> StatementRecord:
    told: dict[str, Any] = {
        "from": f"{iso_utc(START_NS + number * 10**13)[:19]}Z",
        "source": "delivery_note" if payload_kg else "empty",
        "load": {"payload_kg": payload_kg, "plus_minus_kg": 20.0},
        "ref": f"LS-{number}",
    }
    return StatementRecord.model_validate(told).identified()


def states(folder: str, notes: tuple[float, ...]) -> dict[str, tuple[str, str | None]]:
    """The state of each note."""
    logs = sorted(Path(folder).glob("*.log"))
    records = standing(note(number, kg) for number, kg in enumerate(notes, 1))
    drives = read_drives(logs, load_signal_map(SIGNALS), VAN, moments(records), SETTINGS)
    assigned = matched(records, drives.driven, VAN)
    found = learn(VAN, drives.driven, assigned, SETTINGS)
    return {one["ref"]: (one["state"], one["question"]) for one in statements_record(records, assigned, found)}


@pytest.fixture
def folder(tmp_path: Path) -> str:
    write_known_loads(tmp_path, LOADS, 210.0)
    return str(tmp_path)


def test_empty_with_a_load_aboard_is_held_and_asked_about(folder: str) -> None:
    found = states(folder, (0.0, 300.0, 150.0, 0.0, 250.0))
    state, question = found.pop("LS-4")
    assert state == "held"
    assert question is not None
    assert "was something aboard?" in question
    assert set(found.values()) == {("used", None)}


def test_a_note_of_another_tour_counts_less_and_raises_a_question(folder: str) -> None:
    found = states(folder, (0.0, 300.0, 450.0, 400.0, 250.0))
    state, question = found.pop("LS-3")
    assert state in ("weak", "held")
    assert question is not None
    assert "says 450 kg, the drive shows" in question
    assert set(found.values()) == {("used", None)}
