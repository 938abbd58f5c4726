"""What cannot be read is set aside by itself: kept as it came, counted, and in nobody's way."""

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from support.web import Client

from gateway.fleet import Book, Message, fleet_app

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
