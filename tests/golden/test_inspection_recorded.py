"""Inspection of a real car's drives: no false alarm; and of spoiled signal maps: the right one.

That the ten known loads raise none is asked in test_recorded_drives.py, which calibrates with them.
"""

from dataclasses import replace
from pathlib import Path

import pytest
from support.recordings import recordings

from gateway.bus.logs import LogReport
from gateway.bus.signals import SignalMap, load_signal_map
from gateway.calibration.campaign_file import load_campaign
from gateway.calibration.inspection.across_runs import Inspection
from gateway.calibration.inspection.facts import InspectedRun, row_facts
from gateway.calibration.inspection.roll import roll_sign_of
from gateway.calibration.inspection.run_checks import inspect_run
from gateway.calibration.stated_drive import known_drive
from gateway.core.batch_settings import BatchSettings
from gateway.core.vehicle import UNKNOWN_OFFSET_STD_M
from gateway.offline import campaigns as offline_campaigns
from gateway.offline.campaigns import batches_of_motion, inspect, read_whole_log, rows_within
from gateway.records import Batch, Motion, Signal

SETTINGS = BatchSettings()


def findings(campaign: str) -> dict[int, list[str]]:
    found: Inspection = inspect(load_campaign(recordings() / campaign), SETTINGS)
    assert found.refusal is None
    return {one.run.number: [f"{finding.severity}:{finding.kind}" for finding in one.findings] for one in found.runs}


def test_the_validation_part_changes_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    def spoiled_at_the_end(path: Path, signal_map: SignalMap) -> tuple[Motion, LogReport]:
        motion, report = read_whole_log(path, signal_map)
        columns = motion.columns.copy()
        late = motion.t_ns > motion.t_ns[0] + 0.67 * (motion.t_ns[-1] - motion.t_ns[0])
        columns[late, motion.signals.index(Signal.VERTICAL_ACCELERATION)] *= 3.0
        return Motion(motion.signals, motion.t_ns, columns), report

    monkeypatch.setattr(offline_campaigns, "read_whole_log", spoiled_at_the_end)
    campaign = load_campaign(recordings() / "known_loads/campaign.toml")
    (run,) = inspect(campaign, SETTINGS, numbers=[1]).runs
    assert run.findings == ()


@pytest.mark.parametrize("trip", ["a", "b"])
def test_a_real_car_raises_neither_fault_nor_warning(trip: str) -> None:
    for found in findings(f"real_drive/campaign_trip_{trip}.toml").values():
        assert [one for one in found if not one.startswith("note:")] == []


def test_no_run_of_a_short_vehicle_with_solid_axles_is_refused() -> None:
    """Its body rolls little beside the pitch, less than a wrong axis moves in other vehicles."""
    found = findings("solid_axles/known_loads/campaign_roll.toml")
    assert {one for each in found.values() for one in each} <= {"warning:speed_missing"}


@pytest.mark.parametrize(
    ("folder", "campaign", "log", "old", "new", "expected"),
    [
        ("known_loads", "campaign", 7, "PitchRate", "RollRate", "pitch_rate_axis"),
        ("known_loads", "campaign", 7, "PitchRate", "YawRate", "pitch_rate_axis"),
        ("known_loads", "campaign", 7, "AccelZ", "AccelX", "acceleration_axis"),
        ("known_loads", "campaign", 7, 'PitchRate"\nsign = 1', 'PitchRate"\nsign = -1', "pitch_rate_sign"),
        ("real_drive", "campaign_trip_a", 1, "sign = -1", "sign = 1", "pitch_rate_sign"),
        ("real_drive", "campaign_trip_a", 1, "AngularRateZ", "AngularRateY", "pitch_rate_axis"),
        ("real_drive", "campaign_trip_a", 1, "AngularRateZ", "AngularRateX", "pitch_rate_axis"),
        ("real_drive", "campaign_trip_a", 1, "AccelerationX", "AccelerationY", "acceleration_axis"),
    ],
)
def test_a_spoiled_signal_map_is_named(
    folder: str, campaign: str, log: int, old: str, new: str, expected: str, tmp_path: Path
) -> None:
    source = recordings() / folder
    text = (source / "signals.toml").read_text(encoding="utf-8")
    assert old in text
    assert faults_with(text.replace(old, new, 1), source, campaign, log, tmp_path) == [expected]


@pytest.mark.parametrize(
    ("folder", "campaign", "log", "pitch", "roll", "expected"),
    [
        ("known_loads", "campaign_roll", 7, "PitchRate", "RollRate", []),
        ("known_loads", "campaign_roll", 7, "RollRate", "PitchRate", ["rates_swapped"]),
        ("known_loads", "campaign_roll", 7, "PitchRate", "YawRate", ["roll_rate_axis"]),
        ("solid_axles/known_loads", "campaign_roll", 10, "PitchRate", "YawRate", ["roll_rate_axis"]),
        ("real_drive", "campaign_trip_a", 1, "AngularRateZ", "AngularRateY", []),
        ("real_drive", "campaign_trip_a", 1, "AngularRateY", "AngularRateZ", ["rates_swapped"]),
        ("real_drive", "campaign_trip_a", 1, "AngularRateZ", "AngularRateX", ["roll_rate_axis"]),
    ],
)
def test_a_roll_rate_at_the_wrong_place_is_named(
    folder: str, campaign: str, log: int, pitch: str, roll: str, expected: list[str], tmp_path: Path
) -> None:
    source = recordings() / folder
    text = (source / "signals_roll.toml").read_text(encoding="utf-8")
    of_pitch, of_roll = ("AngularRateZ", "AngularRateY") if folder == "real_drive" else ("PitchRate", "RollRate")
    assert f'"{of_pitch}"' in text
    assert f'"{of_roll}"' in text
    head, tail = text.split("[signals.roll_rate]")
    spoiled = head.replace(of_pitch, pitch) + "[signals.roll_rate]" + tail.replace(of_roll, roll)
    assert faults_with(spoiled, source, campaign, log, tmp_path) == expected


def test_the_sensors_place_shows_the_sign_of_the_roll_rate() -> None:
    campaign = load_campaign(recordings() / "known_loads/campaign_roll.toml")
    split = offline_campaigns.split_runs(campaign, SETTINGS, numbers=[1, 10])
    runs = [one.identification for one in split]
    turned = [replace(run, batches=tuple(_roll_turned(batch) for batch in run.batches)) for run in runs]
    unknown = replace(campaign.vehicle, sensor_offset_left_m=0.0, sensor_offset_left_std_m=UNKNOWN_OFFSET_STD_M)
    for seen, vehicle, sign in ((runs, campaign.vehicle, 1), (turned, campaign.vehicle, -1), (runs, unknown, 0)):
        assert (told := roll_sign_of(seen, vehicle)) is not None
        assert told.sign == sign


def _roll_turned(batch: Batch) -> Batch:
    assert batch.roll_rate_radps is not None
    return replace(batch, roll_rate_radps=-batch.roll_rate_radps)


def faults_with(signals: str, source: Path, campaign: str, log: int, tmp_path: Path) -> list[str]:
    """Kinds of the faults of one run, read with this signal map beside the databases of ``source``."""
    spoiled = signals.replace('dbc = ["', f'dbc = ["{source}/')
    (tmp_path / "signals.toml").write_text(spoiled, encoding="utf-8")
    loaded = load_campaign(source / f"{campaign}.toml")
    run = loaded.runs[log - 1]
    signal_map = load_signal_map(tmp_path / "signals.toml")
    motion = rows_within(read_whole_log(loaded.log_of(run), signal_map)[0], end_s=700.0)
    batches = batches_of_motion(motion, signal_map, SETTINGS)
    known = known_drive(log, str(run.log), run.payload_kg, loaded.front_share_pct(run), batches)
    one = InspectedRun(known, facts=row_facts(motion, signal_map.traits))
    found = inspect_run(one, loaded.vehicle, SETTINGS)
    return [str(finding.kind) for finding in found if finding.severity == "fault"]
