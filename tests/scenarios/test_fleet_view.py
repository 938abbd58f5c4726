"""deploy/fleet without containers: a few vehicles, and what breaks. `make fleet-test` does it with fifty."""

from collections.abc import Iterator

import pytest
from support.broker import needs_mosquitto
from support.fleet_view import FleetView, fleet_view
from support.patience import wait_until
from support.postgres import needs_postgres

pytestmark = [needs_mosquitto, needs_postgres]


@pytest.fixture(scope="module")
def view(tmp_path_factory: pytest.TempPathFactory) -> Iterator[FleetView]:
    with fleet_view(tmp_path_factory.mktemp("fleet"), n_vehicles=4) as running:
        yield running


def drive(view: FleetView, n: int) -> None:
    for vehicle in view.vehicles:
        vehicle.drive(n)


def settled(view: FleetView) -> None:
    assert wait_until(view.has_all), (view.count("estimate"), view.n_estimates, view.subscriber.said)
    view.compare()


def test_every_record_of_every_vehicle_is_one_row(view: FleetView) -> None:
    drive(view, 20)
    settled(view)


def test_a_killed_broker_costs_nothing(view: FleetView) -> None:
    """Killed with the subscriber away: what it took since it last saved is forgotten, and the vehicles say it again."""
    view.subscriber.stop()
    drive(view, 30)
    assert wait_until(lambda: sum(vehicle.uplink.report().n_delivered for vehicle in view.vehicles) > 150)
    view.broker.kill()
    drive(view, 10)
    view.broker.start()
    view.subscriber.start()
    settled(view)


def test_a_killed_subscriber_costs_nothing(view: FleetView) -> None:
    drive(view, 20)
    view.subscriber.kill()
    drive(view, 20)
    view.subscriber.start()
    settled(view)


def test_a_database_that_is_away_costs_nothing(view: FleetView) -> None:
    drive(view, 20)
    view.database.stop()
    drive(view, 20)
    assert wait_until(lambda: "database away" in view.subscriber.said)
    view.database.start()
    settled(view)
