"""deploy/fleet without containers: a few vehicles, and what breaks. `make fleet-test` does it with fifty."""

from collections.abc import Iterator

import paho.mqtt.client as mqtt
import pytest
from paho.mqtt.enums import CallbackAPIVersion
from support.broker import needs_mosquitto
from support.fleet_view import FleetView, fleet_view, provision, write_table
from support.patience import wait_until
from support.postgres import needs_postgres

# paho leaves the socket of a handshake that failed to the garbage collector
LEFT = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")

pytestmark = [needs_mosquitto, needs_postgres, LEFT]


@pytest.fixture(scope="module")
def view(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FleetView]:
    with fleet_view(tmp_path_factory.mktemp("fleet"), n_vehicles=4) as running:
        yield running


UNREADABLE = (
    ("estimates", b"no JSON \0"),
    ("estimates", b"[]"),
    ("estimates", b"{}"),
    ("estimates", b'{"id": "a\\u0000", "t_end": "2026-01-01T00:05:00Z", "rejected": []}'),
    ("events", b'{"id": "event-1-a", "revision": 1000000000000000000000000000000}'),
    ("status", b'{"state": "online", "vin": 5}'),
    ("elsewhere", b"{}"),
    ("trips", b"[" * 100_000),
)
"""Branch and payload of what nobody can read."""


def settled(view: FleetView) -> None:
    assert wait_until(view.has_all), (view.count("estimate"), view.n_estimates, view.subscriber.said)
    view.compare()


def test_every_record_of_every_vehicle_is_one_row(view: FleetView) -> None:
    view.vehicles.drive(20)
    settled(view)


def test_a_killed_broker_costs_nothing(view: FleetView) -> None:
    """Killed with the subscriber away: what it took since it last saved is forgotten, and the vehicles say it again."""
    view.subscriber.stop()
    view.vehicles.drive(30)
    assert wait_until(lambda: sum(vehicle.uplink.report().n_delivered for vehicle in view.vehicles) > 150)
    view.broker.kill()
    view.vehicles.drive(10)
    view.broker.start()
    view.subscriber.start()
    settled(view)


def test_the_page_of_the_fleet_shows_every_vehicle(view: FleetView) -> None:
    lines = view.subscriber.lines()
    assert set(lines) == {vehicle.id for vehicle in view.vehicles}
    for line in lines.values():
        assert line["estimate"]["payload_kg"]
        assert line["estimate"]["weights"]["gross"]["kg"]
        assert line["status"]["state"] == "online"


def test_a_vehicle_writes_below_its_own_name_alone_and_reads_nothing(view: FleetView) -> None:
    one, another = view.vehicles[:2]
    folder = view.output / "vehicles" / one.id
    client = mqtt.Client(CallbackAPIVersion.VERSION2, "intruder", protocol=mqtt.MQTTv5)
    client.username_pw_set(one.id, (folder / "broker-password").read_text().strip())
    client.tls_set(str(folder / "fleet-ca.pem"))
    heard: list[str] = []
    answers: dict[int, str] = {}
    client.on_message = lambda _client, _userdata, message: heard.append(message.topic)
    client.on_publish = lambda _client, _userdata, mid, code, _told: answers.update({mid: str(code)})
    client.connect("127.0.0.1", view.broker.port)
    client.subscribe("springscale/#", qos=1)
    client.loop_start()
    forged = client.publish(f"springscale/{another.id}/estimates", b"{}", qos=1).mid
    announced, falsely = (
        client.publish(f"homeassistant/device/springscale_{name}/config", b"{}", qos=1).mid
        for name in (one.id, another.id)
    )
    broken = [client.publish(f"springscale/{one.id}/{branch}", payload, qos=1).mid for branch, payload in UNREADABLE]
    assert wait_until(lambda: {forged, announced, falsely, *broken} <= set(answers))
    client.disconnect()
    client.loop_stop()
    assert (answers[forged], {answers[mid] for mid in broken}, heard) == ("Not authorized", {"Success"}, [])
    assert answers[falsely] == "Not authorized"
    assert answers[announced] in ("Success", "No matching subscribers")  # as it is where no Home Assistant listens
    assert wait_until(lambda: view.count("unreadable") == len(UNREADABLE))
    with view.database.connect() as connection:
        rows = connection.execute("DELETE FROM unreadable RETURNING topic, payload").fetchall()
    assert view.subscriber.said.count('"unreadable", "topic"') == len(UNREADABLE)
    assert rows == [(f"springscale/{one.id}/{branch}", payload) for branch, payload in UNREADABLE]
    view.vehicles.drive(5)
    settled(view)


def test_nothing_is_sent_to_a_broker_without_the_fleets_session(view: FleetView) -> None:
    """A new disk: no session, no subscriber yet. What it would drop stays in the vehicles."""
    view.subscriber.stop()
    view.broker.kill()
    view.broker.forget()
    view.broker.start()
    view.vehicles.drive(10)
    n_before = view.count("estimate")
    for vehicle in view.vehicles:
        assert wait_until(lambda told=vehicle.uplink: "No matching subscribers" in (told.report().last_fault or ""))
    view.subscriber.start()
    settled(view)
    assert view.count("estimate") == n_before + 10 * len(view.vehicles)


def test_a_killed_subscriber_costs_nothing(view: FleetView) -> None:
    view.vehicles.drive(20)
    view.subscriber.kill()
    view.vehicles.drive(20)
    view.subscriber.start()
    settled(view)


def test_a_database_that_is_away_costs_nothing(view: FleetView) -> None:
    view.vehicles.drive(20)
    view.database.stop()
    view.vehicles.drive(20)
    assert wait_until(lambda: "database away" in view.subscriber.said)
    view.database.start()
    settled(view)


def test_a_vehicle_removed_from_the_table_is_refused(view: FleetView) -> None:
    """provision.py again, without one of them: the others keep their passwords."""
    kept = {
        vehicle.id: (view.output / f"vehicles/{vehicle.id}/broker-password").read_text() for vehicle in view.vehicles
    }
    gone = view.vehicles.pop()
    gone.stop()  # its state lies in the folder that goes with it
    write_table(view.folder / "fleet.csv", [vehicle.id for vehicle in view.vehicles])
    provision(view.folder, f"127.0.0.1:{view.broker.port}")
    view.broker.reload()
    for vehicle in view.vehicles:
        assert (view.output / f"vehicles/{vehicle.id}/broker-password").read_text() == kept[vehicle.id]
    assert not (view.output / "vehicles" / gone.id).exists()
    refused = mqtt.Client(CallbackAPIVersion.VERSION2, "gone", protocol=mqtt.MQTTv5)
    refused.username_pw_set(gone.id, kept[gone.id].strip())
    refused.tls_set(str(view.folder / "ca.pem"))
    told: list[str] = []
    refused.on_connect = lambda _client, _userdata, _flags, code, _told: told.append(str(code))
    refused.connect("127.0.0.1", view.broker.port)
    assert wait_until(lambda: refused.loop(0.1) is not None and bool(told))
    assert told == ["Not authorized"]
    view.vehicles.drive(5)
    assert wait_until(lambda: view.count(f"estimate WHERE vehicle_id <> '{gone.id}'") == view.n_estimates)


def test_without_postgresql_a_file_takes_its_place(view: FleetView) -> None:
    """The last test: what this subscriber acknowledges never reaches PostgreSQL."""
    view.subscriber.stop()
    view.subscriber.start(FLEET_DATABASE=str(view.folder / "fleet.sqlite"))
    view.vehicles.drive(5)
    ids = {vehicle.id for vehicle in view.vehicles}
    assert wait_until(lambda: {name for name, line in view.subscriber.lines().items() if line["estimate"]} >= ids)
    assert (view.folder / "fleet.sqlite").exists()
