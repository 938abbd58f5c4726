"""What springscale estimate says of each batch, of refusals and their likely cause, and of logs not quite sound."""

import csv
import gzip
import json
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.bus_drive import white_noise
from support.calibrated import calibration_file
from support.commands import called, run
from support.configured import service_config
from support.encoded import encode_signals
from support.estimates import make_estimate, posterior_of

import gateway.cli.estimate as command
from gateway.bus.logs import open_whole_log
from gateway.bus.logs.candump_write import write_candump
from gateway.bus.signals import load_signal_map
from gateway.cli.estimate import sentence
from gateway.errors import LogUnreadableError, SpringscaleError
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import UNKNOWN, Estimate, Quantity, Weight, Weights
from gateway.estimates.field_kinds import without_dates
from gateway.records import F64, Signal, Why
from gateway.units import NS_PER_S

DEMO = str(files("gateway") / "demo" / "paper_van.json")


def said(monkeypatch: pytest.MonkeyPatch, log: Path, *batches: Estimate) -> SpringscaleError | None:
    """The error with which the command ends for these batches; None if it succeeds."""

    def weighed(*_: Any, **__: Any) -> Iterator[Estimate]:
        yield from batches

    monkeypatch.setattr(command, "estimates_of_logs", weighed)
    done = called("estimate", log, "--signals", "springscale:reference", "--calibration", DEMO)
    assert done.exception is None or isinstance(done.exception, SpringscaleError), done.exception
    return done.exception


@pytest.fixture
def log(tmp_path: Path) -> Path:
    (tmp_path / "drive.log").write_text("")
    return tmp_path / "drive.log"


def test_another_vehicles_calibration_is_named_as_the_likely_cause(monkeypatch: pytest.MonkeyPatch, log: Path) -> None:
    """Where most batches moved as another vehicle does."""
    unlike = (make_estimate(0, Why.MODEL_MISFIT), make_estimate(1, Why.OUT_OF_RANGE), make_estimate(2, Why.TOO_SLOW))
    fault = said(monkeypatch, log, *unlike)
    assert fault.exit_code == 1
    assert "model_misfit (1 batch): no payload and front share explain these spectra" in str(fault)
    assert "What to do: make sure that the calibration is this vehicle's" in str(fault)
    likely = (
        "The likely cause: this is not the log of the vehicle that was calibrated, paper_van (wheelbase 2.8 m, 1240 kg"
    )
    assert likely in str(fault)


def test_without_a_calibration_the_advice_is_how_to_get_one(monkeypatch: pytest.MonkeyPatch, log: Path) -> None:
    """Seven refusals were printed and the command ended with 0; --json gives the spectra, and ends with 0."""

    def weighed(*_: Any, **__: Any) -> Iterator[Estimate]:
        yield from (make_estimate(n, Why.NO_CALIBRATION) for n in range(7))

    monkeypatch.setattr(command, "estimates_of_logs", weighed)
    done = called("estimate", log, "--signals", "springscale:reference")
    assert done.exit_code == 1
    assert "no_calibration (7 batches)" in str(done.exception)
    assert "`springscale learn LOGS" in str(done.exception)
    assert len(run("estimate", log, "--signals", "springscale:reference", "--json").stdout.splitlines()) == 7


def misfits(speed_mps: float) -> list[Estimate]:
    return [replace(make_estimate(n, Why.MODEL_MISFIT), mean_speed_mps=speed_mps) for n in range(3)]


SLOW, STUCK, MISFIT = (make_estimate(0, why) for why in (Why.TOO_SLOW, Why.ACCELERATION_STUCK, Why.MODEL_MISFIT))
SUSPECTED = {  # batches, and whether another vehicle's calibration is named as the likely cause
    "loads beyond those that taught": ([make_estimate(n, Why.OUT_OF_RANGE) for n in range(3)], False),
    "road and sensor": ([SLOW, STUCK, MISFIT], False),
    "a half, which is not most": ([STUCK, MISFIT], False),
    "a speed that calibration saw": (misfits(14.0), True),
    "a speed that it never saw": (misfits(30.0), False),
}


@pytest.mark.parametrize("batches", SUSPECTED)
def test_the_calibration_is_suspected_for_what_another_vehicle_would_show_alone(
    monkeypatch: pytest.MonkeyPatch, log: Path, batches: str
) -> None:
    refused, is_suspected = SUSPECTED[batches]
    fault = str(said(monkeypatch, log, *refused))
    assert "nothing was weighed" in fault
    assert ("The likely cause" in fault) is is_suspected


def test_one_batch_that_was_weighed_is_enough(monkeypatch: pytest.MonkeyPatch, log: Path) -> None:
    answer = make_estimate(1).answered(posterior_of(270.0, 48.0, 6.0, 0.2))
    assert said(monkeypatch, log, make_estimate(0, Why.MODEL_MISFIT), answer) is None


ANSWER = replace(make_estimate(0), front_share=Quantity(50.5, 0.2, (50.1, 50.9)))


ASIDE = replace(ANSWER, cg_left=Quantity(-0.035, 0.004, (-0.043, -0.027)))
HEAVY = Weights(gross=Weight(2010.0, 6.0, 2000.0, None), rear_axle=Weight(1120.0, 5.0, 1100.0, None))
PAYLOAD, SHARE, SPEED = "payload   100.0 kg ±  12.0 (95 %)", "front share 50.50 % ± 0.40 (95 %)", "    50.4 km/h"
LINES = {  # payload or share is unknown where all known loads stood at one place, or weighed the same
    "an answer": (ANSWER, f"no date, 0:00:00  {PAYLOAD}   {SHARE}{SPEED}"),
    "a refusal": (make_estimate(0, Why.AMBIGUOUS), "no date, 0:00:00  no estimate: ambiguous"),
    "a day after no date": (make_estimate(300, Why.GAP), "no date, 1 day, 1:00:00  no estimate: gap"),
    "a dated log": (make_estimate(5_000_000, Why.GAP), "2017-07-14T02:40:00Z  no estimate: gap"),
    "no share": (replace(ANSWER, front_share=UNKNOWN), f"no date, 0:00:00  {PAYLOAD}   front share unknown{SPEED}"),
    "no payload": (replace(ANSWER, payload=UNKNOWN), f"no date, 0:00:00  payload unknown   {SHARE}{SPEED}"),
    "a place across": (ASIDE, f"no date, 0:00:00  {PAYLOAD}   {SHARE}     -35 mm left ±   8 (95 %){SPEED}"),
    "an overload": (
        replace(ANSWER, weights=HEAVY),
        f"no date, 0:00:00  {PAYLOAD}   {SHARE}{SPEED}   over the limit: gross, rear axle",
    ),
}


@pytest.mark.parametrize("what", LINES)
def test_a_batch_is_one_line(what: str) -> None:
    estimate, line = LINES[what]
    assert sentence(without_dates(estimate_to_json(estimate))) == line


def test_frames_of_several_channels_are_reported_unless_one_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_text("".join(f"(1790000000.5) {name} 120#0011223344556677\n" for name in ("can0", "can1")))
    both = f"{path}: mapped frames are on can0, can1; if these are one bus twice, name one in the map"
    for channel, remark in ((None, both), ("can0", f"{path}: left out: 1 frame of other channels")):
        chunks, report = open_whole_log(path, channel)
        assert sum(map(len, chunks)) == (2 if channel is None else 1)
        assert list(report.remarks()) == [remark]


MAP = ("--signals", "springscale:reference")


def write(path: Path, samples: tuple[F64, ...], t_s: F64) -> None:
    """A candump log of the reference map."""
    signals = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.ROLL_RATE, Signal.SPEED)
    told = dict(zip(signals, samples, strict=True)) | {Signal.LONGITUDINAL_ACCELERATION: np.zeros(len(t_s))}
    t_ns = np.round((1.7e9 + t_s) * 1e9).astype(np.int64)
    frames = encode_signals(load_signal_map("springscale:reference"), dict.fromkeys(told, t_ns), told)
    write_candump(frames, "can0", path)


@pytest.mark.parametrize("start_s", [0.0, 1.7e9])
def test_a_log_without_a_date_gives_relative_times_in_every_form(tmp_path: Path, start_s: float) -> None:
    """Two batches of 20 s each, and a stop of a minute in a third; none of 1970."""
    log, t_s = tmp_path / "a.log", np.arange(12_000) / 100.0
    speed = np.where(t_s < 50.0, 14.0, 0.0)
    noise = np.random.default_rng(1).standard_normal((3, len(t_s)))
    write(log, (9.81 + noise[0], 0.05 * noise[1], 0.05 * noise[2], speed), start_s + t_s - 1.7e9)
    asked = ("estimate", log, *MAP, "--window-s", "20")
    text, as_json, as_csv = (called(*asked, *form).stdout for form in ((), ("--json",), ("--csv",)))
    records = [json.loads(one) for one in as_json.splitlines()]
    rows = list(csv.DictReader(as_csv.splitlines()))
    assert len(records) == len(rows) == text.count("\n") >= 2
    assert ("no date, 0:00:20  " in text, "has no date" in called(*asked).stderr) == (not start_s, not start_s)
    assert "1970" not in text + as_json + as_csv
    for n, record in enumerate(records):
        assert (record["t_start"] is None, record["t_end"] is None) == (not start_s, not start_s)
        assert record["t_start_ns"] == pytest.approx((start_s + 20 * n) * 1e9, abs=2e8)
        assert int(rows[n]["t_end_ns"]) == record["t_end_ns"]
        assert (rows[n]["t_start"] == "") == (not start_s)
    stops = [stop for record in records for stop in record["way"]["stops"]]
    assert stops
    for stop in stops:
        assert (stop["t_start"] is None) == (stop.get("t_start_ns", 0) > 0) == (not start_s)


UNREADABLE = {
    "missing": None,
    "empty": b"",
    "garbage": b"\0\xff no log\n" * 40,
    "gzip cut in its header": gzip.compress(b"(1.0) can0 123#00\n")[:8],
}


@pytest.mark.parametrize("content", UNREADABLE.values(), ids=UNREADABLE.keys())
def test_a_log_that_cannot_be_read_takes_nothing_from_those_before_it(tmp_path: Path, content: bytes | None) -> None:
    """The last window of the log before is still open when its end is reached."""
    service_config(tmp_path, calibration_file().to_json(), estimator="ratio_index", batch__window_s=20.0)
    drives, bad = [tmp_path / "1.log", tmp_path / "2.log"], tmp_path / "bad.log"
    for n, drive in enumerate(drives):
        write_candump(white_noise(21.0, (1_790_000_000 + 3600 * n) * NS_PER_S, seed=n), "can0", drive)
    if content is not None:
        bad.write_bytes(content)
    options = ("--config", str(tmp_path / "springscale.toml"))
    alone, found = called("estimate", *drives, *options), called("estimate", *drives, bad, *options)
    assert alone.stdout.count("\n") == 2  # a batch a log
    assert found.stdout == alone.stdout
    assert isinstance(found.exception, LogUnreadableError)
    assert str(found.exception).startswith(f"{bad}: ")
