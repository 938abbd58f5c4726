"""The log lines of a test, as events and fields."""

from typing import Any

import pytest

from gateway.log import Event


def logged(caplog: pytest.LogCaptureFixture) -> list[tuple[Event, dict[str, Any]]]:
    """Every event of ours so far, with its fields."""
    ours = [record for record in caplog.records if record.name == "gateway"]
    return [(Event(record.getMessage()), vars(record)["fields"]) for record in ours]


def names(caplog: pytest.LogCaptureFixture) -> list[Event]:
    """Every event of ours so far."""
    return [event for event, _ in logged(caplog)]


def fields_of(caplog: pytest.LogCaptureFixture, event: Event) -> dict[str, Any]:
    """The fields of the last of these events."""
    return [fields for found, fields in logged(caplog) if found is event][-1]
