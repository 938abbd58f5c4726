"""Load events and trips in the store: last revisions only, one row of numbers with the estimates, nothing lost."""

import json
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from support.estimates import make_record
from support.patience import PATIENCE_S
from support.sequence import drained

from gateway.store import Store
from gateway.store.journal import BATCHES
from gateway.uplink.outbox import Outbox


def entry(n: int, revision: int = 1, kind: str = "event") -> dict[str, Any]:
    place = {"latitude_deg": 47.1, "longitude_deg": 8.5}
    return {"id": f"{kind}-{n}-abc", "revision": revision, "place": place, "stops": [{"place": place}], "from": place}


def write(store: Store, record: dict[str, Any], t_end_ns: int = 0) -> str:
    kind = record["id"].partition("-")[0]
    return store.write_entry(kind, record["id"], t_end_ns, json.dumps(record))


def revisions(store: Store, **question: Any) -> list[tuple[str, int]]:
    told = map(json.loads, store.reader().entries(**question).items)
    return [(one["id"], one["revision"]) for one in told]


@pytest.fixture(params=["on disk", "held"])
def store(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    with closing(Store.open(tmp_path)) as opened:
        if request.param == "held":
            monkeypatch.setattr(opened._database, "add", _refuse)
            opened.is_on_disk = False
        else:
            opened.is_on_disk = True
        yield opened
        monkeypatch.undo()


def _refuse(*_: Any) -> Any:
    raise OSError("no disk")


def settled(store: Store) -> None:
    if store.is_on_disk:
        assert store.flush(PATIENCE_S)


def test_a_revision_takes_the_place_of_the_one_before(store):
    for one in (entry(1), entry(2), entry(1, 2), entry(3, kind="trip")):
        write(store, one)
        settled(store)
    assert revisions(store, kind="event") == [("event-2-abc", 1), ("event-1-abc", 2)]
    assert revisions(store, kind="trip") == [("trip-3-abc", 1)]
    assert revisions(store, newest_first=True, limit=1) == [("trip-3-abc", 1)]


def test_the_cursor_shows_every_new_revision(store):
    write(store, entry(1))
    settled(store)
    page = store.reader().entries()
    write(store, entry(1, 2))
    write(store, entry(2))
    settled(store)
    assert revisions(store, cursor=page.last_cursor) == [("event-1-abc", 2), ("event-2-abc", 1)]


def test_times_choose(store):
    for n in range(4):
        write(store, entry(n), t_end_ns=n * 10)
    settled(store)
    assert revisions(store, since_ns=10, until_ns=30) == [("event-1-abc", 1), ("event-2-abc", 1)]


def test_estimates_are_linked_past_the_entries_between(tmp_path):
    with closing(Store.open(tmp_path)) as store:
        first = store.write_estimate(make_record(0))
        write(store, entry(1))
        second = store.write_estimate(make_record(1))
        assert store.flush(PATIENCE_S)
        follower = store.follow(BATCHES, None, lambda: None)
        one, other = follower.read(9)
        follower.close()
        assert (one.cursor, other.cursor) == (first, second)
        assert other.previous == one.number


@pytest.mark.parametrize("with_places", [False, True])
def test_the_outbox_reads_both_kinds_in_order_and_positions_on_request(tmp_path, with_places):
    with closing(Store.open(tmp_path)) as store:
        way = {"start": {"latitude_deg": 1.0, "longitude_deg": 2.0}, "stops": [{"place": {"latitude_deg": 1.0}}]}
        store.write_estimate({**make_record(0), "way": way})
        write(store, entry(1))
        write(store, entry(2, kind="trip"))
        store.write_estimate({**make_record(1), "way": way})
        write(store, entry(1, 2))
        assert store.flush(PATIENCE_S)
        outbox = Outbox(store, "there", with_places=with_places)
        letters = drained(outbox)
        assert [one.branch for one in letters] == ["estimates", "trips", "estimates", "events"]
        assert letters[-1].id == "event-1-abc-2"
        assert ("latitude_deg" in "".join(one.text for one in letters)) is with_places
