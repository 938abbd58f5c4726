"""The real service end to end: bus, pipeline, database and web together."""

import importlib.metadata
import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import can
import httpx
import pytest
from support.bus_drive import bus_drive
from support.configured import service_config
from support.learner import LearnerBench, at
from support.paper_van import PAPER_VAN
from support.patience import PATIENCE_S, wait_until
from support.ports import first_answer, free_port
from support.process import running_service
from support.running_service import Running, serve, stored

from gateway.bus.listen import SourceState
from gateway.bus.logs import write_candump
from gateway.bus.sink import replay
from gateway.cli import main
from gateway.config import load_settings
from gateway.errors import StoreError
from gateway.estimates.as_json import estimate_to_json
from gateway.offline.estimates import estimates_of_logs
from gateway.records import Motion, json_line
from gateway.service.gateway import Gateway, GatewayFailedError
from gateway.setup import setup_of
from gateway.stated.statement import StatementRecord
from gateway.store import Latest

WINDOW_S = 20.0


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """A configuration of the shipped map and calibration on a bus of the test's own."""
    paper_van = PAPER_VAN.read_text()
    keys = {"vehicle__id": "van-17", "batch__window_s": WINDOW_S, "batch__provisional_every_s": 10.0}
    return service_config(tmp_path, paper_van, **keys)


def test_a_bus_without_mapped_frames_is_reported_with_the_look_command(config: Path) -> None:
    """The filters of the bus keep other identifiers out."""
    told: list[str] = []

    def others(service: Running) -> None:
        with can.Bus(interface="virtual", channel=config.parent.name) as bus:
            bus.send(can.Message(arbitration_id=0x123, is_extended_id=False, data=bytes(8)))
        assert wait_until(lambda: service.gateway.source.state is SourceState.BUS_SILENT)
        told.append(service.gateway.status().sentence())

    serve(config, others)
    assert "`springscale look`" in told[0]


@pytest.mark.parametrize("speed", [40.0, "max"])
def test_a_replayed_log_gives_byte_identical_batches_to_estimate(config: Path, speed: float | str) -> None:
    log = config.parent / "drive.log"
    write_candump(bus_drive(70.0, seed=5), "can0", log)
    settings = load_settings(config)
    expected = [
        json_line(estimate_to_json(found))
        for found in estimates_of_logs([log], setup_of(settings), settings.batch.for_core())
    ]
    assert len(expected) == 3  # windows of 20 s; the rest is too short to be a batch
    serve(config, lambda service: service.play(log, speed))
    assert stored(config) == expected


def test_the_last_window_of_a_drive_is_published_once_the_bus_sleeps(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And not only when the next drive begins, tomorrow maybe."""
    monkeypatch.setenv("SPRINGSCALE_BATCH__SILENCE_S", "1.0")
    log = config.parent / "drive.log"
    write_candump(bus_drive(39.9, seed=5), "can0", log)

    def play(service: Running) -> None:
        service.play(log)
        assert wait_until(lambda: len(service.gateway.store.reader().estimates().items) == 2)

    serve(config, play)


def test_the_process_tells_systemd_and_stops_with_exit_code_zero(config: Path, tmp_path: Path) -> None:
    port = free_port()
    address = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(address)
        listener.settimeout(PATIENCE_S)
        told = []
        with running_service(config, SPRINGSCALE_WEB__PORT=str(port), NOTIFY_SOCKET=address) as process:
            while not {"READY=1", "WATCHDOG=1"} <= set(told):
                told += listener.recv(4096).decode().split("\n")
            latest = first_answer(f"http://127.0.0.1:{port}/api/v1/estimates/latest").json()
            assert latest["rejected"] == ["no_estimate_yet"]
            assert latest["payload_kg"] is None
            assert latest["weights"]["gross"]["lacks"] == "estimate"  # the vehicle is calibrated
            assert first_answer(f"http://127.0.0.1:{port}/health/live").status_code == 200
            process.send_signal(signal.SIGTERM)
            _, errors = process.communicate(timeout=PATIENCE_S)
        while "STOPPING=1" not in told:
            told += listener.recv(4096).decode().split("\n")
    assert process.returncode == 0, errors


def test_a_taken_port_is_reported_in_one_line(config: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        command = [sys.executable, "-m", "gateway", "run", "--config", str(config)]
        told = {**os.environ, "SPRINGSCALE_WEB__PORT": str(port)}
        ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, env=told, check=False)
    assert ended.returncode == 1
    assert "Traceback" not in ended.stderr
    assert f"127.0.0.1:{port}" in ended.stderr.strip().splitlines()[-1]


@pytest.mark.parametrize(
    ("written", "replaced", "named"),
    [
        ("vehicle.id", "vehicle.colour = 1\nvehicle.id", "vehicle.colour"),
        ("vehicle.id", 'uplink = {host = "localhost", topic = "fleet/#"}\nvehicle.id', "[uplink] topic 'fleet/#'"),
        ("vehicle.id", 'vehicle.calibrated_as = "another van"\nvehicle.id', "vehicle.calibrated_as says 'another van'"),
        ('"vehicle.json"', '"gone.json"', "gone.json"),
        ('"vehicle.json"', '"cut.json"', "was cut short; restore it or calibrate again"),
        ("springscale:reference", "springscale:nothing", "nothing"),
        ("web.port = 0", 'web.port = "x"', "web.port"),
    ],
)
def test_a_wrong_configuration_ends_with_code_2_and_names_the_fault(
    config: Path, written: str, replaced: str, named: str, capfd: pytest.CaptureFixture[str]
) -> None:
    config.write_text(config.read_text().replace(written, replaced))
    sound = (config.parent / "vehicle.json").read_text()
    (config.parent / "cut.json").write_text(sound[: len(sound) // 2])
    for arguments in (["run", "--config", str(config)], ["check-config", str(config)]):
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        assert ended.value.code == 2
        assert named in capfd.readouterr().err


def test_a_dead_pipeline_ends_the_service_with_its_reason(config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = load_settings(config)

    def broken(_self: object, _motion: Motion) -> None:
        raise ArithmeticError("the flow broke")

    monkeypatch.setattr("gateway.weighing.flow.Flow.feed", broken)
    log = config.parent / "drive.log"
    write_candump(bus_drive(5.0, seed=1), "can0", log)

    def on_started(_gateway: Gateway) -> None:
        threading.Thread(
            target=replay, args=(log, "virtual", settings.bus.channel), kwargs={"speed": "max"}, daemon=True
        ).start()

    with pytest.raises(GatewayFailedError, match="the flow broke"):
        Gateway(settings, setup_of(settings), on_started=on_started).run()


def test_a_service_whose_supervision_fails_stops_its_parts_and_logs_why(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It left by a traceback, and what was accepted but not on disk yet was lost."""
    gateways: list[Gateway] = []

    def broken(_self: object, *_watched: object) -> None:
        if gateways:
            raise ArithmeticError("the watch broke")

    monkeypatch.setattr("gateway.service.gateway.Gateway._dead_part", broken)
    settings = load_settings(config)
    with pytest.raises(GatewayFailedError, match="the watch broke"):
        Gateway(settings, setup_of(settings), on_started=gateways.append).run()
    (gateway,) = gateways
    assert not gateway.store.is_alive()
    assert not gateway.pipeline.is_alive()


@pytest.mark.parametrize(
    "refusal",
    [
        StoreError("springscale.db cannot be read: unable to open database file"),
        TimeoutError("the question took longer than 5 s: ask for less at a time"),
    ],
    ids=["refused", "slow"],
)
def test_a_database_that_cannot_even_be_read_at_the_start_does_not_keep_the_service_from_running(
    refusal: Exception, config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As SQLite refuses to open a write-ahead database on a read-only disk, or as a disk is slow after a cut."""

    def refuse(_self: object) -> Latest:
        raise refusal

    monkeypatch.setattr("gateway.store.reader.StoreReader.latest", refuse)
    settings = load_settings(config)
    started = []

    def on_started(gateway: Gateway) -> None:
        started.append(gateway.status().state)
        gateway.request_stop()

    Gateway(settings, setup_of(settings), on_started=on_started).run()
    assert started


PATHS = ("/health/live", "/health/ready", "/api/v1/estimates/latest")


def with_half_a_character(folder: Path) -> bytes:
    """A learner's file whose statement has a note that no encoding can write."""
    note = {"from": at(0), "source": "empty", "load": {"payload_kg": 0.0}, "note": "yard"}
    LearnerBench(folder).learner.loads.state(StatementRecord.model_validate(note), "workshop")
    return (folder / "learning.json").read_bytes().replace(b'"yard"', b'"\\ud800"')


@pytest.mark.parametrize("kind", ["broken", "a link", "half a character"])
def test_a_broken_side_file_is_reported_and_set_aside_without_stopping_the_weighing(config: Path, kind: str) -> None:
    name, state = "learning.json", config.parent / "state"
    state.mkdir()
    content = with_half_a_character(config.parent / "other") if kind == "half a character" else b"{"
    if kind == "a link":
        (state / name).symlink_to("/etc/passwd")
    else:
        (state / name).write_bytes(content)
    told: list[tuple[list[int], tuple[str, ...]]] = []

    def ask(service: Running) -> None:
        answers = [httpx.get(service.gateway.url + path, trust_env=False).status_code for path in PATHS]
        told.append((answers, service.gateway.status().warnings))

    def start() -> tuple[list[int], tuple[str, ...]]:
        serve(config, ask)
        return told[-1]

    seen, (warning,) = start()
    (aside,) = state.glob(f"{name}.broken-*")
    assert aside.name in warning
    assert aside.is_symlink() if kind == "a link" else aside.read_bytes() == content
    assert seen == [200, 200, 200]
    again, warnings = start()
    assert (again, warnings) == (seen, ())


def test_a_broken_token_file_is_reported_and_closes_access_without_stopping_the_weighing(config: Path) -> None:
    state = config.parent / "state"
    state.mkdir()
    (state / "tokens.json").write_bytes(b"{")

    def ask(service: Running) -> None:
        answers = [httpx.get(service.gateway.url + path, trust_env=False).status_code for path in PATHS]
        assert answers == [200, 401, 401]
        (warning,) = service.gateway.status().warnings
        assert "tokens.json" in warning

    serve(config, ask)
    assert (state / "tokens.json").read_bytes() == b"{"


def test_the_status_is_answered_when_no_file_can_be_opened(config: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The benchmark's loop, which also outlives a flood that takes every file descriptor."""
    settings, seen = load_settings(config), []

    def refuse(_self: object, name: str) -> str:
        raise OSError(24, f"Too many open files: {name}")

    def on_started(gateway: Gateway) -> None:
        monkeypatch.setattr(importlib.metadata.PathDistribution, "read_text", refuse)
        seen.append((type(gateway._server._loop).__module__, gateway.status().version))
        gateway.request_stop()

    version = importlib.metadata.version("springscale")
    Gateway(settings, setup_of(settings), on_started=on_started).run()
    assert seen == [("uvloop", version)]


def test_an_ipv6_address_stands_in_brackets(config: Path, caplog: pytest.LogCaptureFixture) -> None:
    """The log said http://::1:8000, which is no address."""
    config.write_text(config.read_text().replace("web.port = 0", 'web.port = 0\nweb.host = "::1"'))

    def ask(service: Running) -> None:
        assert service.gateway.url.startswith("http://[::1]:")
        assert httpx.get(f"{service.gateway.url}/health/live", trust_env=False).status_code == 200

    serve(config, ask)
