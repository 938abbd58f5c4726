"""Known weights of a real service: bus, pipeline, web and command line together, through a restart."""

import json
from pathlib import Path
from typing import Any

import pytest
from support.bus_drive import START_NS, white_noise
from support.calibrated import calibration_file
from support.commands import called, run
from support.log import fields_of, names
from support.ports import first_answer
from support.running_service import Running, configuration, counted, estimated, events, serve, stored

from gateway.bus.logs import write_candump
from gateway.calibration.known_weights_file import load_known_weights
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


def test_it_counts_from_the_next_batch_survives_a_restart_and_is_taken_back(config: Path, logs: list[Path]) -> None:
    made: dict[str, Any] = {}
    known: list[str] = []

    def first_run(service: Running) -> None:
        refused = service.ask("calibration", "tare", "set", "--empty")
        assert isinstance(refused.exception, SpringscaleError)
        assert "no_counted_batch" in str(refused.exception)
        service.play(logs[0])
        offer = told(service, "show")["offer"]
        assert (offer["load"]["payload_kg"], offer["load"]["n_batches"]) == (12.0, 2)
        made.update(told(service, "set", "--empty", "--note", "yard"))
        known.append(first_answer(f"{service.gateway.url}/api/v1/status").json()["known_weights_id"])
        assert known[0] == told(service, "show")["known_weights_id"] is not None
        service.play(logs[1])

    def second_run(service: Running) -> None:
        assert told(service, "show")["history"] == [made]
        service.play(logs[2])
        undone = told(service, "undo", "--factory")
        assert undone["known_weights_id"] is None
        assert undone["history"][0]["ended"]["why"] == "back_to_factory"

    serve(config, first_run)
    known_now = estimated(config, *logs[1:])  # as the service would now
    raw = estimated(config, *logs, options=("--no-known-weights",))
    serve(config, second_run)

    # The first drive's two batches were sent before it was stated. The short rests of drives differ in their reasons:
    # on the bus silence ended them, in a file its end.
    found = counted(stored(config))
    assert found == [*counted(raw)[:2], *counted(known_now)]
    assert len(found) == 6
    assert all("known_weights_id" not in text for text in stored(config) if text not in found[2:])
    for record in map(json.loads, found[2:]):
        assert record["raw_payload_kg"] == 12.0
        assert 0.0 < record["payload_kg"] < 9.0
        assert record["payload_std_kg"] < record["raw_payload_std_kg"]
        assert record["known_weights_id"] == known[0]
    assert [json.loads(text)["id"] for text in found[:2]] == made["batch_ids"]
    happened = [kind for kind in events(config) if kind.startswith("known_weight")]
    assert happened == ["known_weight_taken_back", "known_weight_stated"]
    assert estimated(config, *logs) == raw  # taken back: the same again, byte for byte


def test_a_false_ticket_is_held_shown_and_moves_nothing(config: Path, logs: list[Path]) -> None:
    def meet(service: Running) -> None:
        service.play(logs[0])
        assert service.gateway.store.flush(60.0)
        batch = json.loads(service.gateway.store.reader().estimates().items[0])
        weight = f"payload_kg=400,at={batch['t_end']}"
        made = service.told("calibration", "ticket", "add", weight)
        assert (made["state"], made["payload_kg"], made["estimated_payload_kg"]) == ("held", 400.0, 12.0)
        warnings = first_answer(f"{service.gateway.url}/api/v1/status").json()["warnings"]
        assert any("a known weight of 400 kg contradicts the estimate of 12 ±" in warning for warning in warnings)
        service.play(logs[1])

    serve(config, meet)
    records = [json.loads(text) for text in counted(stored(config))]
    assert [record["payload_kg"] for record in records] == [12.0] * 4


def test_a_copied_file_gives_the_same_numbers_elsewhere(config: Path, logs: list[Path], tmp_path: Path) -> None:
    def meet(service: Running) -> None:
        service.play(logs[0])
        told(service, "set", "--empty")

    serve(config, meet)
    here = estimated(config, logs[1])
    copy = tmp_path / "elsewhere.json"
    (tmp_path / "state" / "known_weights.json").rename(copy)
    assert estimated(config, logs[1]) != here
    assert estimated(config, logs[1], options=("--known-weights", str(copy))) == here
    (tmp_path / "vehicle.json").write_text(calibration_file(payload_kg=13.0, front_share_pct=51.0).to_json())
    arguments = ["estimate", str(logs[1]), "--config", str(config), "--known-weights", str(copy)]
    other = called(*arguments)
    assert isinstance(other.exception, SpringscaleError)
    assert "no known weight in use" in str(other.exception)
    assert other.exception.exit_code == 2


def test_check_config_looks_at_known_weights_too(config: Path, logs: list[Path], tmp_path: Path) -> None:
    def meet(service: Running) -> None:
        service.play(logs[0])
        told(service, "set", "--empty")

    serve(config, meet)
    good = run("check-config", config, "--json")
    held = load_known_weights(tmp_path / "state" / "known_weights.json")
    knowledge = held.knowledge(held.entries[0].calibration_id, "ratio_index")
    assert json.loads(good.output)["known_weights_id"] == knowledge.id
    (tmp_path / "state" / "known_weights.json").write_text("{")
    fault = called("check-config", config).exception
    assert isinstance(fault, SpringscaleError)
    assert "known_weights.json" in str(fault)
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
    assert not (tmp_path / "state" / "known_weights.json").exists()


def test_another_calibration_leaves_them_in_the_history_alone(
    config: Path, logs: list[Path], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO", "gateway")
    before = calibration_file(payload_kg=12.0, front_share_pct=51.0).id

    def meet(service: Running) -> None:
        service.play(logs[0])
        told(service, "set", "--empty")

    def meet_again(service: Running) -> None:
        state = told(service, "show")
        assert (state["known_weights_id"], state["history"][0]["state"]) == (None, "other_calibration")

    serve(config, meet)
    assert Event.CALIBRATION_CHANGED not in names(caplog)
    other = calibration_file(payload_kg=13.0, front_share_pct=51.0)
    (tmp_path / "vehicle.json").write_text(other.to_json())
    serve(config, meet_again)
    assert fields_of(caplog, Event.CALIBRATION_CHANGED) == {"calibration_id": other.id, "before": before}
