"""`make fleet-test`: fifty vehicles, and everything between them and the database killed in turn, the broker thrice.

`make fleet-test VEHICLES=500` has more of them, a hundred in each process. Writes what it counted to
build/fleet-test.json, which docs/fleet.md shows (docs/make.py).
"""

import json
import math
import os
import platform
import random
import time
from pathlib import Path
from typing import Any

import pytest
from support.broker import needs_mosquitto
from support.fleet_view import MISSING, FleetView, fleet_view
from support.patience import PATIENCE_S
from support.postgres import needs_postgres

# paho leaves the socket of a handshake that failed to the garbage collector
LEFT = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")

pytestmark = [needs_mosquitto, needs_postgres, LEFT]

RESULTS = Path(__file__).parents[2] / "build/fleet-test.json"
N_VEHICLES = int(os.environ.get("SPRINGSCALE_FLEET", "50"))
N_PROCESSES = math.ceil(N_VEHICLES / 50)  # select(), which paho uses, knows a thousand files
N_BATCHES = 200  # of each vehicle: 16 hours of driving
BLOWS = ("broker", "broker with the subscriber away", "subscriber", "broker", "subscriber", "database")


def test_nothing_is_lost_and_nothing_doubled(tmp_path: Path) -> None:
    dice = random.Random(18)
    with fleet_view(tmp_path, N_VEHICLES, N_PROCESSES) as view:
        begun_s = time.monotonic()
        for blow in dice.sample(BLOWS, len(BLOWS)):
            view.vehicles.drive(N_BATCHES // (2 * len(BLOWS)))
            time.sleep(dice.uniform(0.0, 1.0))  # somewhere in the middle of it
            strike(view, blow)
        view.vehicles.drive(N_BATCHES - view.vehicles.state()[0].n_estimates)
        wait_for_all(view)
        seconds = time.monotonic() - begun_s
        view.compare()
        counted = counts(view, seconds)
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(counted, indent=1) + "\n")
    assert counted["messages_said_again"] > 0  # it was worth killing something


def strike(view: FleetView, blow: str) -> None:
    """Kill it, drive on without it, and start it again."""
    if blow == "subscriber":
        view.subscriber.kill()
        view.vehicles.drive(N_BATCHES // (2 * len(BLOWS)))
        view.subscriber.start()
    elif blow == "database":
        view.database.stop()
        view.vehicles.drive(N_BATCHES // (2 * len(BLOWS)))
        time.sleep(1.0)
        view.database.start()
    else:
        is_away = blow != "broker"
        if is_away:
            view.subscriber.kill()
            view.vehicles.drive(5)
            time.sleep(1.0)
        view.broker.kill()
        view.vehicles.drive(N_BATCHES // (2 * len(BLOWS)) - 5 * is_away)
        view.broker.start()
        if is_away:
            view.subscriber.start()


def wait_for_all(view: FleetView) -> None:
    """Waits as long as rows come; the time limit begins anew with each."""
    n_rows, moved_s = -1, time.monotonic()
    while not view.has_all():
        n_now = view.count("estimate") + view.count("entry")
        if n_now != n_rows:
            n_rows, moved_s = n_now, time.monotonic()
        assert time.monotonic() - moved_s < PATIENCE_S, (n_rows, view.n_estimates, view.subscriber.said[-2000:])
        time.sleep(0.2)


def counts(view: FleetView, seconds: float) -> dict[str, Any]:
    with view.database.connect() as connection:
        row = connection.execute("SELECT version()").fetchone()
        size = connection.execute("SELECT pg_total_relation_size('estimate')").fetchone()
    n_rows = view.count("estimate") + view.count("entry")
    told = view.vehicles.state()
    n_acknowledged = sum(vehicle.n_delivered for vehicle in told)
    n_revised = view.count("entry WHERE revision = 2")
    return {
        "vehicles": len(told),
        "processes_of_vehicles": N_PROCESSES,
        "estimates": sum(vehicle.n_estimates for vehicle in told),
        "entries": sum(vehicle.n_entries for vehicle in told),
        "blows": {blow: BLOWS.count(blow) for blow in dict.fromkeys(BLOWS)},
        "estimate_rows": view.count("estimate"),
        "entry_rows": view.count("entry"),
        "records_missing": view.count(f"({MISSING}) AS missing"),
        "ids_doubled": n_rows
        - view.count("(SELECT DISTINCT id FROM estimate UNION ALL SELECT DISTINCT id FROM entry) AS ids"),
        "unreadable": view.count("unreadable"),
        "messages_acknowledged": n_acknowledged,
        "messages_said_again": max(0, n_acknowledged - n_rows - n_revised),
        "connections_of_vehicles": sum(vehicle.n_connections for vehicle in told),
        "bytes_of_an_estimate": round(int(str(size[0] if size else 0)) / view.count("estimate")),
        "seconds": round(seconds),
        "machine": platform.machine(),
        "database": " ".join(str(row[0] if row else "").split()[:2]),
    }
