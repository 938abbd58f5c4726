"""All that an outbox holds, and a back-end that keeps to what docs/uplink.md says of ``sequence``."""

import json
from typing import Any

from gateway.records import json_line
from gateway.uplink.outbox import Outbox, OutboxMessage


class BackEnd:
    """Takes messages in the order of their arrival; ``missing`` are the gaps it found, (after, before) in numbers."""

    def __init__(self) -> None:
        self.missing: list[tuple[int, int]] = []
        self.ids: dict[str, None] = {}  # in the order of their first arrival
        self._last: dict[str, int] = {}

    def take(self, text: str) -> None:
        record: dict[str, Any] = json.loads(text)
        sequence = record["sequence"]
        last = self._last.get(sequence["stream"], 0)
        if sequence["previous"] is not None and sequence["previous"] > last:
            self.missing.append((last, sequence["number"]))
        self._last[sequence["stream"]] = max(last, sequence["number"])
        self.ids.setdefault(record["id"])


def without_sequence(text: str) -> str:
    """The part of a message that the store holds."""
    record = json.loads(text)
    del record["sequence"]
    return json_line(record)


def drained(outbox: Outbox, most: int = 10_000) -> list[OutboxMessage]:
    """Deliver everything that waits, or the first ``most`` messages."""
    found: list[OutboxMessage] = []
    while len(found) < most and (message := outbox.next()) is not None:
        found.append(message)
        outbox.delivered()
    return found
