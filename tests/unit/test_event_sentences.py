"""Load events and trips as `springscale events` says them."""

from typing import Any

import pytest

from gateway.cli.events import entry_sentence
from gateway.core.events.entry import Entry, EntryKind

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


def test_what_was_unloaded_when_and_how_surely() -> None:
    assert sentence() == "2026-01-01 00:14 to 00:31  180 kg unloaded (± 20 kg), 87% probable; 220 kg aboard then"


@pytest.mark.parametrize(
    ("t_end", "span"),
    [
        ("2026-01-01T00:31:00.000000Z", "2026-01-01 00:14 to 00:31  "),
        ("2026-01-08T00:00:02.000000Z", "2026-01-01 00:14 to 2026-01-08 00:00  "),
    ],
)
def test_the_day_is_said_again_where_it_is_another_one(t_end: str, span: str) -> None:
    assert sentence(t_end=t_end).startswith(span)
