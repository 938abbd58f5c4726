"""springscale events: what it says, and that logs give what the service reports of the same frames."""

import gzip
import json
from pathlib import Path
from typing import Any

import pytest
from support.bus_drive import white_noise
from support.calibrated import calibration_file
from support.commands import called
from support.configured import service_config

from gateway.bus.logs import write_candump
from gateway.cli.events import entry_sentence
from gateway.core.events.entry import Entry, EntryKind
from gateway.errors import LogUnreadableError
from gateway.units import NS_PER_S

T0_NS = 1_790_000_000 * NS_PER_S
HOUR_NS = 3600 * NS_PER_S


@pytest.fixture
def drives(tmp_path: Path) -> tuple[str, str]:
    """Two of one batch each, an hour apart, and the service's configuration; the calibration always answers 200 kg."""
    keys = {"estimator": "ratio_index", "batch__window_s": 20.0, "vehicle__id": "van-17"}
    service_config(tmp_path, calibration_file().to_json(), **keys)
    logs = tmp_path / "1.log", tmp_path / "2.log"
    for n, log in enumerate(logs):
        write_candump(white_noise(21.0, T0_NS + n * HOUR_NS, seed=n), "can0", log)
    return str(logs[0]), str(logs[1])


def said(folder: Path, *arguments: str) -> str:
    found = called("events", *arguments, "--config", folder / "springscale.toml")
    assert found.exit_code == 0, found.output
    return found.stdout


def told(folder: Path, *logs: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in said(folder, *logs, "--json").splitlines()]


def test_each_drive_is_a_trip_with_what_was_aboard(tmp_path: Path, drives: tuple[str, str]) -> None:
    first, second = told(tmp_path, *drives)
    assert [one["id"].partition("-")[0] for one in (first, second)] == ["trip", "trip"]
    assert (first["vehicle_id"], first["payload_kg"], first["is_over"]) == ("van-17", 200.0, True)
    assert (second["payload_kg"], second["is_over"]) == (200.0, False)
    assert first["distance_m"] == pytest.approx(21.0 * 15.0, abs=10.0)
    lines = said(tmp_path, *drives).splitlines()
    assert lines[0].startswith("2026-09-21 14:13 to 14:13  drove 0.3 km with 200 kg (± ")
    assert lines[1].endswith(", still going")


UNREADABLE = {
    "missing": None,
    "empty": b"",
    "garbage": b"\0\xff no log\n" * 40,
    "gzip cut in its header": gzip.compress(b"(1.0) can0 123#00\n")[:8],
}


@pytest.mark.parametrize("content", UNREADABLE.values(), ids=UNREADABLE.keys())
@pytest.mark.parametrize("command", ["events", "estimate"])
def test_a_log_that_cannot_be_read_takes_nothing_from_those_before_it(
    tmp_path: Path, drives: tuple[str, str], command: str, content: bytes | None
) -> None:
    """The last window of the log before is still open when its end is reached."""
    bad = tmp_path / "bad.log"
    if content is not None:
        bad.write_bytes(content)
    options = ("--config", str(tmp_path / "springscale.toml"))
    alone = called(command, *drives, *options)
    found = called(command, *drives, bad, *options)
    assert alone.stdout.count("\n") == 2  # a batch a log
    assert found.stdout == alone.stdout
    assert isinstance(found.exception, LogUnreadableError)
    assert str(found.exception).startswith(f"{bad}: ")


def test_a_withdrawn_event_does_not_say_how_sure_it_was() -> None:
    load = {"payload_kg": 300.0}
    record = {
        "t_start": "2026-09-21T14:13:20Z", "t_end": "2026-09-21T14:20:00Z", "change_kg": 31.0, "place": None,
        "change_interval95_kg": [1.0, 61.0], "probability": 0.43, "is_withdrawn": True, "before": load, "after": load,
    }  # fmt: skip
    assert entry_sentence(Entry(EntryKind.EVENT, "event-1-a", T0_NS, record)) == (
        "2026-09-21 14:13 to 14:20  withdrawn, nothing was loaded or unloaded after all; 300 kg on board then"
    )


def test_logs_out_of_order_are_refused(tmp_path: Path, drives: tuple[str, str]) -> None:
    first, second = drives
    config = str(tmp_path / "springscale.toml")
    found = called("events", second, first, "--config", config)
    assert isinstance(found.exception, LogUnreadableError)
    assert f"{first}: begins before {second}: name the logs in order of time" in str(found.exception)


def test_logs_without_a_date_have_no_order(tmp_path: Path, drives: tuple[str, str]) -> None:
    undated = tmp_path / "undated.log"
    write_candump(white_noise(21.0, 5 * NS_PER_S, seed=1), "can0", undated)
    (trip,) = told(tmp_path, str(undated))
    assert (trip["t_start"], trip["t_start_ns"]) == (None, 5 * NS_PER_S)
    assert said(tmp_path, str(undated)).startswith("no date, 0:00:05 to 0:00:25  drove 0.3 km")
    for logs in ((undated, drives[0]), (drives[0], undated)):
        found = called("events", *logs, "--config", tmp_path / "springscale.toml")
        assert str(found.exception) == f"{undated}: has no date: nothing tells which log came first; name it alone"


EVENT: dict[str, Any] = {
    "revision": 1,
    "t_start": "2026-01-01T00:14:59.000000Z",
    "t_end": "2026-01-01T00:31:00.000000Z",
    "change_kg": -180.4,
    "change_interval95_kg": (-200.0, -160.0),
    "is_withdrawn": False,
    "probability": 0.87,
    "after": {"payload_kg": 220.2},
    "place": None,
}


def sentence(**changed: Any) -> str:
    return entry_sentence(Entry(EntryKind.EVENT, "event-1", 1, {**EVENT, **changed}))


def test_an_unloading_has_its_time_mass_and_interval() -> None:
    assert sentence() == "2026-01-01 00:14 to 00:31  180 kg unloaded (± 20 kg), 87% probable; 220 kg on board then"


@pytest.mark.parametrize(
    ("t_end", "span"),
    [
        ("2026-01-01T00:31:00.000000Z", "2026-01-01 00:14 to 00:31  "),
        ("2026-01-08T00:00:02.000000Z", "2026-01-01 00:14 to 2026-01-08 00:00  "),
    ],
)
def test_a_new_date_is_printed_once(t_end: str, span: str) -> None:
    assert sentence(t_end=t_end).startswith(span)
