"""A record that cannot be read is left out and counted, and delays no other."""

import json
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest
from support.configured import service_config
from support.estimates import make_record
from support.log import fields_of
from support.patience import PATIENCE_S, wait_until
from support.running_service import Running, serve
from support.web import Client

from gateway.fleet import Book, Message, fleet_app
from gateway.log import Event
from gateway.status import StoreState
from gateway.store import Store
from gateway.store.schema import JOURNAL_COLUMNS, TABLES, JournalRow, checksum

GOOD = {"id": "a", "t_end": "2027-01-15T07:55:00Z", "rejected": []}
LONG = "x" * 1000


def estimate(**more: object) -> bytes:
    return json.dumps(GOOD | more).encode()


FLEET = {  # topic below springscale/, and payload
    "no JSON": ("van-1/estimates", b"no JSON \0"),
    "another shape": ("van-1/estimates", b"[]"),
    "an empty object": ("van-1/estimates", b"{}"),
    "no UTF-8": ("van-1/estimates", b"\xff\xfe"),
    "NaN beside the status": ("van-1/status", b'{"state": "online", "x": NaN}'),
    "infinity beside the status": ("van-1/status", b'{"state": "online", "x": 1e999}'),
    "a number of 5,000 digits": ("van-1/status", b'{"state": "online", "x": %s}' % (b"9" * 5000)),
    "a VIN that is a number": ("van-1/status", b'{"state": "online", "vin": 5}'),
    "a NUL in a text": ("van-1/status", b'{"state": "a\\u0000b"}'),
    "half a character": ("van-1/status", b'{"state": "\\ud800"}'),
    "an endless state": ("van-1/status", json.dumps({"state": LONG}).encode()),
    "an endless name of a place": ("van-1/estimates", estimate(weights={LONG: None})),
    "an endless list of reasons": ("van-1/estimates", estimate(rejected=["gap"] * 1000)),
    "weights that are a number": ("van-1/estimates", estimate(weights=7)),
    "a payload that is NaN": ("van-1/estimates", estimate().replace(b"}", b', "payload_kg": NaN}')),
    "a NUL in an id": ("van-1/events", b'{"id": "a\\u0000b", "revision": 1}'),
    "an infinite payload": ("van-1/estimates", estimate().replace(b"}", b', "payload_kg": 1e999}')),
    "a payload of 400 digits": ("van-1/estimates", estimate(payload_kg=10**400)),
    "a number of 65 bits": ("van-1/estimates", estimate(sequence={"stream": "s", "number": 2**64, "previous": 0})),
    "a number of 64 bits": ("van-1/estimates", estimate(sequence={"stream": "s", "number": 2**63, "previous": 0})),
    "a revision of 64 bits": ("van-1/events", b'{"id": "a", "revision": 9223372036854775808}'),
    "a revision of 10^30": ("van-1/events", b'{"id": "a", "revision": 1%s}' % (b"0" * 30)),
    "a revision that is a word": ("van-1/alarms", b'{"id": "a", "revision": "one"}'),
    "a time that is a number": ("van-1/estimates", estimate(t_end=1e18)),
    "a time without a zone": ("van-1/estimates", estimate(t_end="2027-01-15T07:55:00")),
    "a name with a blank": ("a van/status", b'{"state": "online"}'),
    "a name with a line feed": ("van-1\n/status", b'{"state": "online"}'),
    "an unknown branch": ("van-1/elsewhere", b"{}"),
    "no branch": ("van-1", b"{}"),
    "a hundred thousand brackets": ("van-1/trips", b"[" * 100_000),
}


@pytest.mark.parametrize("what", FLEET)
def test_the_fleet_sets_one_record_aside_and_takes_the_others(what: str, tmp_path: Path) -> None:
    topic, payload = FLEET[what]
    poison = Message(f"springscale/{topic}", payload)
    others = [Message(f"springscale/van-{n}/status", b'{"state": "online"}') for n in (2, 3)]
    with closing(Book(str(tmp_path / "fleet.sqlite"))) as book:
        assert [told for told, _ in book.write([others[0], poison, others[1]])] == [poison.topic]
        assert book.counts == {"unreadable": 1, "status": 2}
        answer = Client(fleet_app(book)).get("/api/v1/fleet")
        assert answer.status_code == 200
        assert [line["vehicle_id"] for line in answer.json()["items"]] == ["van-2", "van-3"]
        assert answer.json()["n_unreadable"] == 1
    with sqlite3.connect(tmp_path / "fleet.sqlite") as looked:
        assert looked.execute("SELECT topic, payload FROM unreadable").fetchall() == [(poison.topic, payload)]


@pytest.mark.parametrize("column", ["status", "estimate"])
@pytest.mark.parametrize("text", ['{"state": 5, "vin": 5}', "[]", "no JSON", '{"id": "a", "t_end": 7}'])
def test_a_row_of_another_version_costs_the_page_one_vehicle_s_number(column: str, text: str, tmp_path: Path) -> None:
    """One vehicle with `vin: 5` made the page fail for all."""
    with closing(Book(str(tmp_path / "fleet.sqlite"))) as book:
        for n in (1, 2):
            book.write([
                Message(f"springscale/van-{n}/status", b'{"state": "online"}'),
                Message(f"springscale/van-{n}/estimates", estimate(payload_kg=7.0)),
            ])  # fmt: skip
        with sqlite3.connect(tmp_path / "fleet.sqlite") as other:
            table, field = ("vehicle", "status") if column == "status" else ("estimate", "record")
            other.execute(f"UPDATE {table} SET {field} = ? WHERE vehicle_id = 'van-1'", (text,))
        answer = Client(fleet_app(book)).get("/api/v1/fleet").json()
        first, second = answer["items"]
        assert (first[column], answer["n_unreadable"]) == (None, 1)
        assert (second["status"]["state"], second["estimate"]["payload_kg"]) == ("online", 7.0)


RECORD = make_record(1)
SHAPES = {  # of a row whose checksum is right
    "no JSON": "[" * 100_000,
    "a list": "[]",
    "null": "null",
    "a number": "5",
    "a word": '"x"',
    "an empty object": "{}",
    "an id that is a number": '{"id": 5}',
    **{
        f"{name} = {wrong!r:.20}": json.dumps(RECORD | {name: wrong})
        for name, wrong in (
            ("t_end_ns", "x"), ("t_end_ns", 10**30), ("t_end_ns", None), ("t_start_ns", True), ("t_start", 7),
            ("rejected", 5), ("rejected", ["no such reason"]), ("weights", 5), ("weights", {}), ("posterior", [1]),
            ("posterior", {"mean": [1.0], "own": [1.0], "sources": {}}), ("shares", 7), ("estimator", 7), ("way", []),
            ("payload_kg", "heavy"), ("payload_interval95_kg", [1.0]), ("error_budget", [{}]), ("spectra", {}),
        )
    },
}  # fmt: skip
ROUTES = ("estimates/latest", "estimates", "events", "trips", "alarms", "cab", "weights/latest", "export.csv", "status")
ROUTES += ("events.csv", "trips.csv", "vss", "statements", "learning")


def plant(database: Path, kind: str, texts: dict[str, str]) -> None:
    """Rows as a program with a fault, or another version, might have written them."""
    with closing(sqlite3.connect(database)) as connection:
        for n, text in enumerate(texts.values()):
            row = ((1 << 30) + n, kind, f"{kind}-{n}", 10**18 + n, 0, 10**18, text)
            marks = ", ".join("?" * 8)
            connection.execute(f"INSERT INTO journal ({JOURNAL_COLUMNS}, crc) VALUES ({marks})", (*row, checksum(row)))
        connection.commit()


@pytest.mark.parametrize("kind", ["estimate", "rejection", "remainder", "alarm", "event", "trip"])
def test_the_service_starts_and_answers_whatever_lies_in_its_journal(kind: str, tmp_path: Path) -> None:
    """Three shapes of eight ended the start with a traceback, and one event made the cab page fail."""
    config = service_config(tmp_path)
    store = Store.open(tmp_path / "state")
    store.write_estimate(make_record(0))
    assert store.close() == 0
    plant(tmp_path / "state" / "springscale.db", kind, SHAPES)
    codes: dict[str, int] = {}
    status: dict[str, Any] = {}

    def ask(running: Running) -> None:
        for route in ROUTES:
            codes[route] = httpx.get(f"{running.gateway.url}/api/v1/{route}", timeout=PATIENCE_S).status_code
        assert make_record(0)["id"] in httpx.get(f"{running.gateway.url}/api/v1/estimates").text
        status.update(running.http("/api/v1/status"))

    serve(config, ask)
    assert codes == dict.fromkeys(ROUTES, 200)
    if kind != "remainder":  # which nobody is shown
        assert status["store"]["n_bad_records"] >= 5, "what is no object is left out"


@pytest.mark.parametrize(
    "wrong",
    [{"t_end_ns": 1 << 63}, {"t_end_ns": -(10**30)}, {"id": "\ud800"}, {"t_end_ns": object()}],
    ids=["64 bits", "10^30", "half a character", "no number"],
)
def test_the_store_leaves_one_record_out_and_keeps_the_others(
    wrong: dict[str, Any], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """SQLite's error was taken for a failing disk, or ended the thread that writes: every later record was lost."""
    with closing(Store.open(tmp_path)) as store:
        store.write_estimate(make_record(0))
        row = JournalRow(0, "estimate", "poison", 0, 0, 0, "{}")
        columns = {"id": wrong.get("id", "poison"), "t_end_ns": wrong.get("t_end_ns", 0)}
        store._buffer.append(replace(row, **columns))
        store.write_estimate(make_record(1))
        assert store.flush(PATIENCE_S)
        health = store.health()
        assert (health.state, health.n_written, health.n_bad_records) == (StoreState.OK, 2, 1)
        assert [json.loads(text)["id"] for text in store.reader().estimates().items] == [
            make_record(n)["id"] for n in (0, 1)
        ]
    assert "JournalRow" in fields_of(caplog, Event.STORE_BAD_RECORD)["record"]


@pytest.mark.parametrize("table", sorted(TABLES))
@pytest.mark.parametrize("when", ["before the start", "while it runs"])
def test_a_database_that_lacks_a_table_is_set_aside(table: str, when: str, tmp_path: Path) -> None:
    """Records stayed in memory for ever, and nothing warned of it."""

    def drop() -> None:
        with closing(sqlite3.connect(tmp_path / "springscale.db", timeout=PATIENCE_S)) as other:
            other.execute(f"DROP TABLE {table}")

    if when == "before the start":
        Store.open(tmp_path).close()
        drop()
    with closing(Store.open(tmp_path)) as store:
        if when == "while it runs":
            store.write_estimate(make_record(0))
            assert store.flush(PATIENCE_S)
            drop()
            store.suspect_file(is_damaged=False)
        store.write_estimate(make_record(1))
        assert wait_until(lambda: store.flush(0.0) and store.health().state is StoreState.OK)
        assert store.health().set_aside is not None
        assert make_record(1)["id"] in store.reader().estimates().items[-1]
