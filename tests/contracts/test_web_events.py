"""Events and trips over HTTP: pages to follow, files, the stream; every revision at least once."""

import csv
import io

import pytest
from support.days import RULES, day
from support.web import Gateway

from gateway.core.events.ledger import Ledger
from gateway.records import json_line
from gateway.web.routes.events_trips_alarms import LoadEvent, Trip

DAY = day(0.0, 500.0, 500.0, 320.0, 200.0, batches=2)


@pytest.fixture(autouse=True)
def _driven(gateway: Gateway) -> None:
    ledger = Ledger(RULES)
    for one in DAY:
        gateway.publish(one)
        for entry in ledger.add(one):
            gateway.store.write_entry(entry.kind, entry.id, entry.t_end_ns, json_line(entry.record))


def test_events_and_trips_of_a_day(client):
    events = client.get("/api/v1/events").json()
    assert sorted(round(one["change_kg"]) for one in events["items"]) == [-180, -120, 500]
    assert events["next_cursor"] is None
    trips = client.get("/api/v1/trips").json()["items"]
    assert len(trips) == 5
    assert {one["is_over"] for one in trips} == {True, False}


def test_the_cursor_pages_through_all_events(client):
    found, cursor = [], ""
    while cursor is not None:
        page = client.get(f"/api/v1/trips?limit=2{cursor and f'&cursor={cursor}'}").json()
        found += [one["id"] for one in page["items"]]
        cursor = page["next_cursor"]
    assert len(found) == len(set(found)) == 5


@pytest.mark.parametrize(("path", "shape"), [("events", LoadEvent), ("trips", Trip)])
def test_answers_have_the_described_fields_and_no_other(client, path, shape):
    names = {field.alias or name for name, field in shape.model_fields.items()}
    items = client.get(f"/api/v1/{path}").json()["items"]
    assert items
    for one in items:
        shape.model_validate(one, strict=True)
        assert set(one) == names


def test_files(client):
    table = list(csv.DictReader(io.StringIO(client.get("/api/v1/events.csv").text)))
    assert sorted(round(float(row["change_kg"])) for row in table) == [-180, -120, 500]
    assert float(table[0]["change_low95_kg"]) < float(table[0]["change_kg"]) < float(table[0]["change_high95_kg"])
    assert {row["after_n_batches"] for row in table}
    trips = list(csv.DictReader(io.StringIO(client.get("/api/v1/trips.csv").text)))
    assert sum(float(row["carried_tkm"]) for row in trips) > 0.0
