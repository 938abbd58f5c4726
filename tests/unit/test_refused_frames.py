"""Frames whose length or values contradict the database: the cause is told with its numbers, and no other is blamed."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, cast

import numpy as np
import pytest
from support.archive import Here, write_manifest
from support.bus_drive import bus_drive
from support.commands import called
from support.half_car_road import VAN

from gateway.archive import place_of, receipts
from gateway.archive.manifest import load_manifest
from gateway.archive.reprocessing import reprocess
from gateway.bus.logs import write_candump
from gateway.bus.logs.open import open_log
from gateway.bus.signals import Decoder, load_signal_map, shipped_map
from gateway.calibration.inspection.facts import InspectedRun, LogFacts, row_facts
from gateway.calibration.inspection.finding import Kind, Severity
from gateway.calibration.inspection.run_checks import inspect_run
from gateway.calibration.stated_drive import known_drive
from gateway.core.batch_settings import BatchSettings
from gateway.offline.campaigns import read_whole_log
from gateway.records import Frames, Signal
from gateway.service.pipeline import Pipeline

SHIPPED: Final = shipped_map("reference")
DEMO: Final = Path(str(files("gateway"))) / "demo" / "paper_van.json"
SECONDS: Final = 150.0
WRONG_BLAME: Final = ("antenna", "too smooth", "silent", "map of this vehicle", "What to do")
ACCEL, GYRO, GPS = 0x120, 0x121, 0x130


def of_length(can_id: int, length: int) -> Callable[[Frames], Frames]:
    """Every frame of one message padded or cut."""

    def spoil(frames: Frames) -> Frames:
        lengths = np.where(frames.can_id == can_id, np.uint8(length), frames.length).astype(np.uint8)
        payload = np.where(np.arange(8) < lengths[:, None], frames.payload, np.uint8(0))
        return Frames(frames.t_ns, frames.can_id, lengths, payload)

    return spoil


def as_sent(frames: Frames) -> Frames:
    return frames


@dataclass(frozen=True)
class Case:
    """One way to spoil frames or database, and the report that is expected of it."""

    told: str
    signals: frozenset[Signal]
    spoil: Callable[[Frames], Frames] = as_sent
    database: tuple[str, str] = ("", "")


CASES: Final = {
    "padded speed": Case(
        "GPS_SPEED (130): 750 frames have 8 bytes, the database says 4", frozenset({Signal.SPEED}), of_length(GPS, 8)
    ),
    "short rates": Case(
        "IMU_GYRO (121): 15,000 frames have 6 bytes, the database says 8",
        frozenset({Signal.PITCH_RATE, Signal.ROLL_RATE, Signal.YAW_RATE}),
        of_length(GYRO, 6),
    ),
    "short accelerations": Case(
        "IMU_ACCEL (120): 15,000 frames have 7 bytes, the database says 8",
        frozenset(
            {Signal.VERTICAL_ACCELERATION, Signal.LONGITUDINAL_ACCELERATION, Signal.LATERAL_ACCELERATION}
        ),
        of_length(ACCEL, 7),
    ),
    "narrow range of the speed": Case(
        "speed (GPS_SPEED): 750 values read 13.63 to 14.18 m/s, beyond the range 0 to 5 m/s",
        frozenset({Signal.SPEED}),
        database=("[0|131.07]", "[0|5]"),
    ),
    "narrow range of the acceleration": Case(
        "vertical_acceleration (IMU_ACCEL): 15,000 values read 7.606 to 12.06 m/s^2, beyond the range -4 to 4 m/s^2",
        frozenset({Signal.VERTICAL_ACCELERATION}),
        database=("SG_ AccelZ : 32|16@1- (0.001,0) [-32.768|32.767]", "SG_ AccelZ : 32|16@1- (0.001,0) [-4|4]"),
    ),
}  # fmt: skip


@pytest.fixture(params=CASES)
def spoiled(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Case, Path, Path]:
    """A case, its log and its signal map."""
    case, folder = CASES[request.param], tmp_path / "van"
    folder.mkdir()
    database = SHIPPED.with_name("springscale_reference.dbc").read_text()
    assert case.database[0] in database
    if case.database[0]:
        database = database.replace(*case.database)
    (folder / "springscale_reference.dbc").write_text(database)
    (folder / "signals.toml").write_text(SHIPPED.read_text())
    write_candump(case.spoil(bus_drive(SECONDS, seed=3)), "can0", folder / "drive.log")
    return case, folder / "drive.log", folder / "signals.toml"


def test_a_single_refused_frame_is_reported_but_not_blamed() -> None:
    decoder = Decoder(load_signal_map("springscale:reference"))
    frames = bus_drive(100.0, seed=3)
    length = frames.length.copy()
    length[np.flatnonzero(frames.can_id == GPS)[[3, 5]]] = 8, 2
    decoder.decode(Frames(frames.t_ns, frames.can_id, length, frames.payload))
    (remark,) = decoder.remarks()
    assert remark.text.startswith("GPS_SPEED (130): 2 of 500 frames have 2 to 8 bytes, the database says 4")
    assert decoder.causes() == ()


def test_estimate_reports_only_the_true_cause(spoiled: tuple[Case, Path, Path]) -> None:
    case, log, signals = spoiled
    ended = called("estimate", log, "--signals", signals, "--calibration", DEMO)
    said = str(ended.exception)
    assert said.splitlines()[1].startswith(f"  mend this first: {log}: {case.told}")
    assert not [blame for blame in WRONG_BLAME if blame in said]
    assert f"{log}: {case.told}" in ended.stderr


def test_look_reports_the_cause_before_missing_signals(spoiled: tuple[Case, Path, Path]) -> None:
    case, log, _ = spoiled
    said, _, verdict = called("look", log).stdout.partition("\nThis can")
    assert case.told.partition(": ")[2] in said
    if case.database[0]:  # the shipped database has the true range
        assert "fits" in said
        return
    assert verdict.startswith("not work yet:")
    assert "are refused, as told above" in verdict
    assert "GNSS" not in verdict
    assert "takes gravity off" not in verdict
    assert "and not 9.8" not in said


def test_an_inspection_finds_the_refused_frames_and_no_silent_sensor(spoiled: tuple[Case, Path, Path]) -> None:
    case, log, signals = spoiled
    signal_map = load_signal_map(signals)
    motion, report = read_whole_log(log, signal_map)
    mismatches = tuple((one.text, one.share, one.signals) for one in report.causes())
    nothing = known_drive(1, "drive.log", 0.0, 50.0, ())
    split = InspectedRun(nothing, facts=row_facts(motion, signal_map.traits), log=LogFacts(mismatches=mismatches))
    kinds = (Kind.MAP_MISMATCH, Kind.SENSOR_SILENT, Kind.SPEED_MISSING)
    first, *others = inspect_run(split, VAN, BatchSettings(), kinds)
    assert (first.kind, first.severity) == (Kind.MAP_MISMATCH, Severity.FAULT)
    assert first.text.startswith(case.told)
    assert "roll_rate" in case.signals or all("roll_rate" in other.text for other in others)


def test_reprocess_reports_refused_frames_in_summary_and_receipt(spoiled: tuple[Case, Path, Path]) -> None:
    case, log, _ = spoiled
    folder = log.parent.parent
    write_manifest(folder, "van")
    (folder / "archive.toml").write_text(
        (folder / "archive.toml").read_text().replace("springscale:reference", "van/signals.toml")
    )
    summary = reprocess(load_manifest(str(folder)), place_of(folder / "dataset"), Here())
    assert [text for text in summary.to_json()["refused"] if case.told in text]
    (receipt,) = receipts(folder / "dataset")
    assert [text for text in receipt["logs"][0]["remarks"] if case.told in text]


def test_the_service_warns_of_it(spoiled: tuple[Case, Path, Path]) -> None:
    case, log, signals = spoiled
    signal_map = load_signal_map(signals)
    flow = SimpleNamespace(settings=BatchSettings(), on_batch=lambda *handed: None, on_window=lambda *handed: None)
    pipeline = Pipeline(*cast(Any, (None, Decoder(signal_map), flow, None, None)))
    assert pipeline.fault is None
    for frames in open_log(log, signal_map)[0]:
        pipeline.decoder.decode(frames)
    assert str(pipeline.fault).startswith(case.told)
