"""Rows that came between the outbox's questions for estimates and for entries were passed over for good."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from support.estimates import make_record

from gateway.history import Delivery, Page
from gateway.store import Store, StoreReader
from gateway.uplink import Outbox


class Meanwhile:
    """A store's reader; after its n-th answer the vehicle drives on."""

    def __init__(self, reader: StoreReader, drive_on: Callable[[], None], after: int) -> None:
        self._reader = reader
        self._drive_on = drive_on
        self._left = after

    def estimates(self, **question: Any) -> Page:
        return self._answered(self._reader.estimates(**question))

    def entries(self, **question: Any) -> Page:
        return self._answered(self._reader.entries(**question))

    def delivery(self, uplink: str, **question: Any) -> Delivery:
        return self._reader.delivery(uplink, **question)

    def _answered(self, page: Page) -> Page:
        self._left -= 1
        if self._left == 0:
            self._drive_on()
        return page


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    opened = Store.open(tmp_path)
    yield opened
    opened.close()


@pytest.mark.parametrize("after", range(1, 9))
@pytest.mark.parametrize("ahead", [0, 1, 3])
def test_what_comes_between_two_questions_goes_out_in_its_turn(store: Store, after: int, ahead: int) -> None:
    told: list[str] = []

    def drive(first: int, n: int) -> None:
        """Batches, a load event after every other."""
        for number in range(first, first + n):
            record = make_record(number)
            store.write_estimate(record)
            told.append(record["id"])
            if number % 2:
                event = {"id": f"event-{number}-abc", "revision": 1}
                store.write_entry("event", event["id"], number, json.dumps(event))
                told.append(f"{event['id']}-1")

    drive(0, ahead)
    outbox = Outbox(Meanwhile(store.reader(), lambda: drive(ahead, 6), after), store, "fleet")
    said: list[str] = []
    for _ in range(12):
        letters = outbox.next_letters(4)
        said += [letter.id for letter in letters]
    assert said == told
