"""What springscale estimate says of each batch, of logs that are not quite sound, and of broken sensors."""

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


def test_loads_beyond_those_that_taught_are_no_sign_of_another_vehicle(
    monkeypatch: pytest.MonkeyPatch, log: Path
) -> None:
    fault = said(monkeypatch, log, *(make_estimate(n, Why.OUT_OF_RANGE) for n in range(3)))
    assert "out_of_range (3 batches)" in str(fault)
    assert "The likely cause" not in str(fault)


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


def test_refusals_by_road_or_sensor_do_not_blame_the_calibration(monkeypatch: pytest.MonkeyPatch, log: Path) -> None:
    slow = (
        make_estimate(0, Why.TOO_SLOW),
        make_estimate(1, Why.ACCELERATION_STUCK),
        make_estimate(2, Why.MODEL_MISFIT),
    )
    fault = said(monkeypatch, log, *slow)
    assert fault is not None
    assert "nothing was weighed" in str(fault)
    assert "likely cause" not in str(fault)
    assert "likely cause" not in str(said(monkeypatch, log, *slow[1:]))  # a half is not most


def test_a_speed_that_calibration_never_saw_is_not_laid_on_the_vehicle(
    monkeypatch: pytest.MonkeyPatch, log: Path
) -> None:
    fast = [replace(make_estimate(n, Why.MODEL_MISFIT), mean_speed_mps=30.0) for n in range(3)]
    assert "likely cause" not in str(said(monkeypatch, log, *fast))
    assert "likely cause" in str(said(monkeypatch, log, *(replace(one, mean_speed_mps=14.0) for one in fast)))


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


LINE = "({:.6f}) {} 120#0011223344556677\n"


@pytest.fixture
def log_of(tmp_path):
    def log_of(*lines):
        (tmp_path / "a.log").write_text("".join(lines))
        return tmp_path / "a.log"

    return log_of


def remarks(path, channel=None):
    chunks, report = open_whole_log(path, channel)
    for _ in chunks:
        pass
    return list(report.remarks())


def test_lines_left_out_are_counted_by_reason(log_of):
    path = log_of(LINE.format(1_790_000_000, "can0"), "(2.0) can0 120#011\n", "nonsense\n", "nonsense\n")
    assert set(remarks(path)) == {
        f"{path}: left out, half byte: 1, first in line 2: '(2.0) can0 120#011'",
        f"{path}: left out, no frame: 2, first in line 3: 'nonsense'",
    }


def test_frames_of_several_channels_are_reported_unless_one_is_named(log_of):
    path = log_of(*(LINE.format(1_790_000_000, name) for name in ("can0", "can1")))
    assert remarks(path) == [
        f"{path}: mapped frames are on can0, can1; if these are one bus twice, name one in the map"
    ]
    assert remarks(path, "can0") == [f"{path}: left out: 1 frame of other channels"]


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


MAP = ("--signals", "springscale:reference")
N = 4000  # 40 s at 100 Hz
LENGTHS = (1, 2, 3, 50, 2100)
NOISE = np.random.default_rng(1).standard_normal((3, N))
REST, HELD = np.zeros(N), np.full(N, 14.0)
MOVED = (9.81 + NOISE[0], 0.05 * NOISE[1], 0.05 * NOISE[2], HELD)  # acceleration, pitch rate, roll rate, speed
ONCE = np.where(np.arange(N) == N // 2, 1.0, 0.0)

ODD: dict[str, tuple[F64, F64, F64, F64]] = {
    "all constant": (9.81 + REST, REST, REST, HELD),
    "all zero": (REST, REST, REST, REST),
    "all at the end of their ranges": (32.0 + REST, 2.8 + REST, 2.8 + REST, 100.0 + REST),
    "white noise": MOVED,
    "pitch rate constant": (MOVED[0], REST, REST, HELD),
    "acceleration constant": (9.81 + REST, *MOVED[1:]),
    "one impulse": (9.81 + 20.0 * ONCE, 2.0 * ONCE, REST, HELD),
    "one bit that toggles": (9.81 + 1e-3 * (NOISE[0] > 0.0), 1e-4 * (NOISE[1] > 0.0), REST, HELD),
    "half a drive of nothing": (np.where(np.arange(N) < N // 2, 9.81, MOVED[0]), *MOVED[1:]),
}
STAMPS_S: dict[str, F64] = {
    "one time stamp for all": np.zeros(N),
    "backwards": -np.arange(N) / 100.0,
    "ten in a second": np.arange(N // 10) / 10.0,
    "a day between two": np.arange(20) * 86_400.0,
}


def write(path: Path, samples: tuple[F64, ...], t_s: F64) -> None:
    """A candump log of the reference map."""
    signals = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.ROLL_RATE, Signal.SPEED)
    told = dict(zip(signals, samples, strict=True)) | {Signal.LONGITUDINAL_ACCELERATION: np.zeros(len(t_s))}
    t_ns = np.round((1.7e9 + t_s) * 1e9).astype(np.int64)
    frames = encode_signals(load_signal_map("springscale:reference"), dict.fromkeys(told, t_ns), told)
    write_candump(frames, "can0", path)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """All of them by name."""
    folder, drive_s = tmp_path_factory.mktemp("odd"), np.arange(N) / 100.0
    wanted: dict[str, tuple[tuple[F64, ...], F64]] = {name: (samples, drive_s) for name, samples in ODD.items()}
    wanted |= {name: (tuple(x[: len(t_s)] for x in MOVED), t_s) for name, t_s in STAMPS_S.items()}
    wanted |= {f"{n} samples": (tuple(x[:n] for x in MOVED), drive_s[:n]) for n in LENGTHS}
    for name, (samples, t_s) in wanted.items():
        write(folder / f"{name}.log", samples, t_s)
    return {name: folder / f"{name}.log" for name in wanted}


NAMES = [*ODD, *STAMPS_S, *(f"{n} samples" for n in LENGTHS)]


def commands(log: Path) -> Iterator[list[str]]:
    yield ["look", str(log)]
    for estimator in ("cross_spectrum", "ratio_index"):
        yield ["estimate", str(log), *MAP, "--calibration", DEMO, "--window-s", "20", "--estimator", estimator]


@pytest.mark.parametrize("name", NAMES)
def test_every_log_gives_an_answer_or_a_clear_error(logs: dict[str, Path], name: str) -> None:
    for asked in commands(logs[name]):
        done = called(*asked)
        assert done.exception is None or isinstance(done.exception, SpringscaleError), (asked[0], done.exception)
        assert "Warning" not in done.output


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
