"""The log lines of a running service, read from the standard error of its own process."""

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from support.patience import wait_until
from support.ports import free_port
from support.process import ReplayedService


@pytest.fixture
def journal(tmp_path: Path) -> Iterator[ReplayedService]:
    keys = {"bus__silence_s": 0.5, "batch__provisional_every_s": 10.0, "web__stale_after_s": 1.0}
    keys |= {"uplink__host": "127.0.0.1", "uplink__port": free_port(), "uplink__tls": False}
    with ReplayedService(tmp_path, **keys) as running:
        yield running


def test_every_change_of_state_is_a_line(journal: ReplayedService) -> None:
    wanted = {"bus silent", "estimate stale", "uplink not reached"}
    assert wait_until(lambda: wanted <= set(journal.events()) or journal.process.poll() is not None)
    assert journal.stop() == 0, journal.lines
    entries, events = journal.entries(), journal.events()
    assert all(line[:3] in {"<6>", "<4>"} for line in journal.lines)
    assert events[0] == "started"
    assert events[-1] == "stopped"
    assert events.index("ready") < events.index("bus receiving") < events.index("estimate")
    assert events.count("estimate") == 3  # of 20 s each; what is left of the drive is too short
    assert {entry["payload_kg"] for entry in entries if entry["event"] == "estimate"} == {12.0}
    assert "reasons of rejection changed" not in events
    assert events.count("uplink not reached") == 1  # tried again and again, told once
    states = [entry["state"] for entry in entries if entry["event"] == "state"]
    assert all(one != other for one, other in pairwise(states))
    assert "batch rejected" not in events
