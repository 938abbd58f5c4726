"""Faults of the process itself: it is killed, hung, starved, flooded or badly configured."""

import os
import random
import socket
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import httpx
import pytest
from vm.harness.drives import loaded_drive, log_of
from vm.harness.vehicle import CONFIG, PLAY, SETTINGS, STATE, Answer, Vehicle

Recovered = Callable[[float], None]
N_KILLS = int(os.environ.get("SPRINGSCALE_KILLS", "20"))
COMMIT_EVERY = 4  # of so many kills one falls among commits, the others wherever they fall
GUEST = Path(__file__).parent / "guest"
N_SLOW = 50  # of the 100 places that there are
SHORT_DRIVES = SETTINGS.replace("silence_s = 3.0", "silence_s = 0.5")  # each second of frames is a drive of its own


@pytest.fixture
def many_records(vehicle: Vehicle, tmp_path: Path) -> Vehicle:
    """A service that commits a record every two seconds or so."""
    vehicle.configure(SHORT_DRIVES)
    vehicle.restart()
    pulse = vehicle.put_log(log_of(loaded_drive(1.0, 4), tmp_path / "pulse.log"))
    vehicle.play_pulses(pulse, pause_s=0.8)
    return vehicle


def ids(records: list[Answer]) -> list[str]:
    """Identifiers, none of which may come twice."""
    found = [record["id"] for record in records]
    assert len(found) == len(set(found))
    return found


def wait_for_another(vehicle: Vehicle, n_known: int) -> None:
    """Waits until the service has stored more records than these."""
    vehicle.wait_for(lambda: len(vehicle.stored()) > n_known)


def test_repeated_kills_lose_and_double_nothing(
    many_records: Vehicle, recovered: Recovered, measured: Callable[..., None]
) -> None:
    vehicle, moments = many_records, random.Random(4)
    n_restarts = vehicle.n_restarts()
    vehicle.wait_for(lambda: len(vehicle.stored()) > 2)
    committed = ids(vehicle.stored())
    n_first = len(committed)
    for n in range(N_KILLS):
        vehicle.run("systemctl kill --signal KILL springscale")
        if n % COMMIT_EVERY:
            time.sleep(moments.uniform(1.0, 8.0))  # an emulated processor is starting for most of that time
        else:
            wait_for_another(vehicle, len(committed))
            time.sleep(moments.uniform(0.0, 2.0))  # among its next commits
        found = ids(vehicle.stored())
        assert found[: len(committed)] == committed
        committed = found
    vehicle.run("systemctl kill --signal KILL springscale || true")
    recovered(vehicle.wait_until(lambda status: status["bus"]["state"] == "receiving"))
    assert vehicle.n_restarts() - n_restarts >= N_KILLS // 2  # the other signals found it waiting to be restarted
    vehicle.wait_for(lambda: len(vehicle.stored()) > n_first)
    told = ids(vehicle.records())
    assert told == ids(vehicle.stored("estimate", "rejection"))[: len(told)]
    n_committed = len(vehicle.stored()) - n_first
    assert n_committed >= N_KILLS // COMMIT_EVERY
    measured(kills=N_KILLS, records_after_kills=n_committed)


def test_a_hung_pipeline_is_restarted(vehicle: Vehicle, recovered: Recovered) -> None:
    pid, n_restarts = vehicle.pid(), vehicle.n_restarts()
    vehicle.machine.write("/root/freeze_thread.py", (GUEST / "freeze_thread.py").read_bytes())
    vehicle.run(f"systemd-run --quiet --collect --unit freezer python3 /root/freeze_thread.py {pid} pipeline")
    recovered(vehicle.wait_for(lambda: vehicle.pid() not in (0, pid) and bool(vehicle.status()), timeout_s=180.0))
    assert vehicle.n_restarts() == n_restarts + 1
    journal = vehicle.journal(300)
    assert "Watchdog timeout" in journal
    assert "Fatal Python error: Aborted" in journal  # every thread's stack, for whoever looks for the reason
    assert "pipeline.py" in journal


def test_the_service_restarts_after_the_memory_limit(vehicle: Vehicle, recovered: Recovered) -> None:
    pid, before = vehicle.pid(), ids(vehicle.stored())
    vehicle.run("systemctl set-property --runtime springscale MemoryMax=20M")
    vehicle.wait_for(lambda: vehicle.pid() != pid)
    vehicle.run("systemctl set-property --runtime springscale MemoryMax=512M")
    recovered(vehicle.wait_until(lambda status: True))
    assert "oom-kill" in vehicle.run("journalctl --unit springscale --no-pager --lines 200")
    assert ids(vehicle.stored())[: len(before)] == before


def test_floods_and_slow_clients_cost_no_frame(vehicle: Vehicle, tmp_path: Path) -> None:
    """Whoever is in stays in and is answered, whatever crowd comes after from the same address."""
    frames = loaded_drive(20.0, 5)
    before = vehicle.status()["bus"]
    over = threading.Event()
    answered = threading.Barrier(5)
    outcomes: list[set[object]] = [set() for _ in range(4)]

    def flood(outcome: set[object]) -> None:
        with httpx.Client(timeout=30.0, verify=vehicle.trust) as client:
            try:
                outcome.add(client.get(f"{vehicle.url}/health/live").status_code)
                answered.wait(30.0)
                while not over.is_set():
                    outcome.add(client.get(f"{vehicle.url}/health/live").status_code)
            except (httpx.HTTPError, threading.BrokenBarrierError) as why:
                outcome.add(repr(why))

    threads = [threading.Thread(target=flood, args=(outcome,)) for outcome in outcomes]
    for thread in threads:
        thread.start()
    answered.wait(30.0)
    with ExitStack() as slow_clients:
        for _ in range(N_SLOW):
            slow = slow_clients.enter_context(socket.create_connection((vehicle.machine.address, 8000), 10.0))
            slow.sendall(b"GET /api/v1/status HTTP/1.1\r\nHost: ")
        vehicle.run(f"{PLAY} {vehicle.put_log(log_of(frames, tmp_path / 'drive.log'))}")
        over.set()
        for thread in threads:
            thread.join()
    assert outcomes == [{200}] * 4
    vehicle.wait_for_frames(before["n_frames"] + len(frames))
    after = vehicle.status()["bus"]
    assert [after[key] - before[key] for key in ("n_kernel_dropped", "n_inbox_dropped")] == [0, 0]


def unknown_key(vehicle: Vehicle) -> str:
    vehicle.configure(SETTINGS + 'colour = "red"\n')
    return f"{CONFIG}: web.colour: unknown key"


def cut_calibration(vehicle: Vehicle) -> str:
    vehicle.run("head -c 5000 /etc/springscale/vehicle.json > /etc/springscale/cut.json")
    vehicle.configure(SETTINGS.replace("vehicle.json", "cut.json"))
    return "was cut short"


def newer_database(vehicle: Vehicle) -> str:
    set_schema(vehicle, 99)
    return "has schema 99"


def set_schema(vehicle: Vehicle, version: int) -> int:
    """Write a schema version into the stopped service's database; the one it had."""
    script = (
        f"import sqlite3; c = sqlite3.connect('{STATE}/springscale.db');"
        f"print(c.execute('PRAGMA user_version').fetchone()[0]); c.execute('PRAGMA user_version = {version}')"
    )
    return int(vehicle.run(f'python3 -c "{script}"'))


@pytest.mark.parametrize("fault", [unknown_key, cut_calibration, newer_database])
def test_a_configuration_fault_ends_the_start_without_a_retry(
    fault: Callable[[Vehicle], str], vehicle: Vehicle
) -> None:
    vehicle.run("systemctl stop springscale; systemctl reset-failed springscale 2>/dev/null || true")
    schema = set_schema(vehicle, 0)
    set_schema(vehicle, schema)
    before = ids(vehicle.stored())
    try:
        message = fault(vehicle)
        assert not vehicle.machine.succeeds("systemctl start springscale")
        time.sleep(3.0)  # RestartSec and a little
        shown = vehicle.run("systemctl show --property ExecMainStatus,NRestarts,ActiveState --value springscale")
        assert shown.split() == ["2", "0", "failed"] or sorted(shown.split()) == ["0", "2", "failed"]
        assert message in vehicle.journal(20)
        assert "Traceback" not in vehicle.journal(20)
    finally:
        set_schema(vehicle, schema)
    vehicle.restore()  # mended, it starts
    assert ids(vehicle.stored())[: len(before)] == before
