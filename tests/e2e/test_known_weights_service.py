"""Re-zeroing a real service: bus, pipeline, web and command line together, through a restart."""

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_file
from support.log import fields_of, names
from support.ports import first_answer
from support.running_service import Running, configuration, counted, estimated, events, serve, stored

from gateway.bus.logs import write_candump
from gateway.cli import springscale
from gateway.errors import SpringscaleError
from gateway.log import Event

HOUR_NS = 3_600 * 10**9


@pytest.fixture
def config(tmp_path: Path) -> Path:
    """A vehicle that weighs 12 kg and 51 % whatever it carries, on a bus of the test's own."""
    return configuration(tmp_path, calibration_file(payload_kg=12.0, front_share_pct=51.0).to_json())


def told(service: Running, *arguments: str) -> dict[str, Any]:
    """springscale calibration tare ... --json"""
    return service.told("calibration", "tare", *arguments)


@pytest.fixture
def logs(tmp_path: Path) -> list[Path]:
    """Three drives, an hour from one to the next."""
    paths = [tmp_path / f"drive{n}.log" for n in range(3)]
    for n, path in enumerate(paths):
        write_candump(white_noise(45.0, START_NS + n * HOUR_NS, seed=n), "can0", path)
    return paths


def test_a_tare_counts_from_the_next_batch_survives_a_restart_and_is_undone(config: Path, logs: list[Path]) -> None:
    made: dict[str, Any] = {}

    def first_run(service: Running) -> None:
        refused = service.ask("calibration", "tare", "set", "--empty")
        assert isinstance(refused.exception, SpringscaleError)
        assert "no_counted_batch" in str(refused.exception)
        service.play(logs[0])
        offer = told(service, "show")["offer"]
        assert (offer["zero"]["payload_kg"], offer["zero"]["n_batches"]) == (12.0, 2)
        made.update(told(service, "set", "--empty", "--note", "yard"))
        assert "+12.0" in service.ask("calibration", "tare", "show").output
        assert first_answer(f"{service.gateway.url}/api/v1/status").json()["tare_id"] == made["id"]
        service.play(logs[1])

    def second_run(service: Running) -> None:
        assert told(service, "show")["active"] == made
        service.play(logs[2])
        undone = told(service, "undo", "--factory")
        assert undone["active"] is None
        assert undone["history"][0]["ended"]["why"] == "back_to_factory"

    serve(config, first_run)
    tared = estimated(config, *logs[1:])  # as the service would now: with its tare
    raw = estimated(config, *logs, options=("--no-tare",))
    serve(config, second_run)

    # The first drive's two batches were sent before the tare. The short rests of drives differ in their reasons: on
    # the bus silence ended them, in a file its end.
    found = counted(stored(config))
    assert found == [*counted(raw)[:2], *counted(tared)]
    assert len(found) == 6
    assert all("tare_id" not in text for text in stored(config) if text not in found[2:])
    for record in map(json.loads, found[2:]):
        assert (record["payload_kg"], record["raw_payload_kg"], record["tare_payload_kg"]) == (0.0, 12.0, 12.0)
        assert record["payload_std_kg"] ** 2 == pytest.approx(
            record["raw_payload_std_kg"] ** 2 + record["tare_payload_std_kg"] ** 2
        )
        assert record["tare_id"] == made["id"]
    assert [json.loads(text)["id"] for text in found[:2]] == made["batch_ids"]
    assert [kind for kind in events(config) if kind.startswith("tare")] == ["tare_undone", "tare_set"]
    assert estimated(config, *logs) == raw  # undone: the factory zero again, byte for byte


def test_a_copied_tare_file_gives_the_same_numbers_elsewhere(config: Path, logs: list[Path], tmp_path: Path) -> None:
    def meet(service: Running) -> None:
        service.play(logs[0])
        told(service, "set", "--empty")

    serve(config, meet)
    here = estimated(config, logs[1])
    copy = tmp_path / "elsewhere.json"
    (tmp_path / "state" / "tare.json").rename(copy)
    assert estimated(config, logs[1]) != here
    assert estimated(config, logs[1], options=("--tare", str(copy))) == here
    (tmp_path / "vehicle.json").write_text(calibration_file(payload_kg=13.0, front_share_pct=51.0).to_json())
    arguments = ["estimate", str(logs[1]), "--config", str(config), "--tare", str(copy)]
    other = CliRunner().invoke(springscale, arguments)
    assert isinstance(other.exception, SpringscaleError)
    assert "has no tare in use" in str(other.exception)
    assert other.exception.exit_code == 2


def test_check_config_looks_at_the_tare_too(config: Path, logs: list[Path], tmp_path: Path) -> None:
    def meet(service: Running) -> None:
        service.play(logs[0])
        told(service, "set", "--empty")

    serve(config, meet)
    good = CliRunner().invoke(springscale, ["check-config", str(config), "--json"], catch_exceptions=False)
    (entry,) = json.loads((tmp_path / "state" / "tare.json").read_text())["entries"]
    assert json.loads(good.output)["tare_id"] == entry["id"]
    (tmp_path / "state" / "tare.json").write_text("{")
    fault = CliRunner().invoke(springscale, ["check-config", str(config)]).exception
    assert isinstance(fault, SpringscaleError)
    assert "tare.json" in str(fault)
    assert fault.exit_code == 2


def test_a_drive_that_has_begun_since_is_refused(config: Path, logs: list[Path], tmp_path: Path) -> None:
    short = tmp_path / "short.log"
    write_candump(white_noise(5.0, START_NS + HOUR_NS, seed=9), "can0", short)

    def meet(service: Running) -> None:
        service.play(logs[0])
        service.play(short)
        refused = service.ask("calibration", "tare", "set", "--empty")
        assert isinstance(refused.exception, SpringscaleError)
        assert "load_may_have_changed" in str(refused.exception)

    serve(config, meet)
    assert not (tmp_path / "state" / "tare.json").exists()


def test_the_log_tells_of_another_calibration_and_of_the_tare_that_ends_with_it(
    config: Path, logs: list[Path], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "gateway")
    before = calibration_file(payload_kg=12.0, front_share_pct=51.0).id

    def meet(service: Running) -> None:
        service.play(logs[0])
        told(service, "set", "--empty")

    serve(config, meet)
    assert Event.CALIBRATION_CHANGED not in names(caplog)
    other = calibration_file(payload_kg=13.0, front_share_pct=51.0)
    (tmp_path / "vehicle.json").write_text(other.to_json())
    serve(config, lambda service: None)
    assert fields_of(caplog, Event.CALIBRATION_CHANGED) == {"calibration_id": other.id, "before": before}
    assert fields_of(caplog, Event.TARE_DROPPED)["calibration_id"] == other.id
