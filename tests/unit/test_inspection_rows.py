"""Rates, jitter, gaps and means of a drive's rows."""

from dataclasses import replace

import numpy as np
import pytest
from support.drives import T0_NS, changed, drive, without_rows
from support.inspected import kinds, stated, traits_of_reference, verdict_on

from gateway.calibration.inspection.rows import gravity_findings, rate_findings, row_facts, unmapped_findings
from gateway.core.settings import BatchSettings
from gateway.records import Motion, Signal
from gateway.sim.vans import PAPER_VAN

TRAITS = traits_of_reference()


def rate_kinds(motion: Motion) -> list[str]:
    return [str(finding.kind) for finding in rate_findings(row_facts(motion, TRAITS), BatchSettings())]


def test_facts_are_those_of_the_rows_in_any_order() -> None:
    motion = drive(60.0)
    facts = row_facts(motion, TRAITS)
    shuffled = np.random.default_rng(1).permutation(len(motion))
    other = row_facts(Motion(motion.signals, motion.t_ns[shuffled], motion.columns[shuffled]), TRAITS)
    assert facts.duration_s == other.duration_s == pytest.approx(60.0, abs=0.1)
    assert facts.streams[Signal.PITCH_RATE].rate_hz == pytest.approx(100.0)
    assert facts.streams[Signal.SPEED].rate_hz == pytest.approx(10.0)
    assert facts.mean(Signal.VERTICAL_ACCELERATION) == pytest.approx(9.81, abs=0.05)
    assert np.isnan(facts.mean(Signal.AXLE_WEIGHT))
    for signal, stream in facts.streams.items():
        assert other.streams[signal].rate_hz == stream.rate_hz
        assert other.streams[signal].mean == pytest.approx(stream.mean)


def test_a_sound_drive_has_nothing_to_tell() -> None:
    motion = drive(30.0)
    assert rate_kinds(motion) == []
    assert gravity_findings(row_facts(motion, TRAITS))[1] == []


def test_a_slow_sensor_is_named() -> None:
    assert rate_kinds(drive(30.0, rate_hz=30.0)) == ["rate_low", "rate_low"]


def test_stamps_in_bursts_are_named() -> None:
    motion = drive(30.0)
    since_ns = motion.t_ns - T0_NS
    burst_ns = 30_000_000
    in_burst_ns = since_ns % burst_ns // 100  # three samples of each sensor, a tenth of a millisecond apart
    bursts = replace(motion, t_ns=T0_NS + since_ns // burst_ns * burst_ns + in_burst_ns)
    assert rate_kinds(bursts) == ["jitter", "jitter"]


def test_a_silent_sensor_is_named_and_one_that_is_not_mapped_is_not() -> None:
    motion = drive(30.0)
    silent = changed(motion, Signal.PITCH_RATE, 0.0, 99.0, lambda x: np.full(len(x), np.nan))
    assert rate_kinds(silent) == ["sensor_silent"]
    assert rate_kinds(Motion((motion.signals[0], motion.signals[2]), motion.t_ns, motion.columns[:, [0, 2]])) == []


@pytest.mark.parametrize(
    ("kept", "said"),
    [
        ((0, 1, 2), []),
        ((0, 1), ["fault: neither speed nor wheel_speed is in the signal map"]),
        ((0, 2), ["warning: pitch_rate is not in the signal map; axes and loads cannot be checked"]),
    ],
)
def test_a_signal_that_is_not_mapped_is_named(kept: tuple[int, ...], said: list[str]) -> None:
    motion = drive(30.0)
    assert motion.signals == (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.SPEED)
    mapped = Motion(tuple(motion.signals[i] for i in kept), motion.t_ns, motion.columns[:, list(kept)])
    found = unmapped_findings(row_facts(mapped, TRAITS))
    assert [f"{finding.severity}: {finding.text}" for finding in found] == said


def test_lost_frames_are_a_warning() -> None:
    motion = without_rows(drive(130.0), 30.0, 36.0)
    assert "warning:gaps" in kinds(verdict_on(motion, stated(PAPER_VAN, 3.2), TRAITS))
