"""Inspection of one run: logs that cannot be read, rates and gaps of its rows, and one diagnosis for each way to spoil
it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.drives import T0_NS, drive, without_rows
from support.half_car_road import VAN
from support.inspected import (
    ACCELERATION,
    PITCH_RATE,
    ROLL_RATE,
    driven,
    exchanged,
    kinds,
    scaled,
    stated,
    traits_of_reference,
    verdict_on,
    with_resolution,
    without,
)

from gateway.calibration.inspection.across_runs import inspect_drives
from gateway.calibration.inspection.facts import InspectedRun, LogFacts, RowFacts, row_facts
from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.calibration.inspection.run_checks import inspect_run
from gateway.calibration.stated_drive import known_drive
from gateway.core.batch_settings import BatchSettings
from gateway.core.scheduler import Scheduler
from gateway.records import F64, Motion, Signal, Why
from gateway.sim.parameters import Load
from gateway.sim.speed_profile import Drive, constant, urban
from gateway.sim.vans import PAPER_VAN, VANS
from gateway.units import STANDARD_GRAVITY_MPS2

DURATION_S = 130.0
REAR_M = 3.2
G = STANDARD_GRAVITY_MPS2
DEGREES = 180.0 / np.pi
BIAS_RADPS = 4.0 / DEGREES
EMPTY = stated(PAPER_VAN, REAR_M)


def steady(speed_mps: float = 14.0, duration_s: float = DURATION_S) -> Drive:
    return constant(speed_mps, duration_s, np.random.default_rng(1))


@pytest.fixture(scope="module")
def sound() -> Motion:
    return driven(PAPER_VAN, steady(), REAR_M)


def with_samples(motion: Motion, signal: Signal, change: Callable[[F64], F64]) -> Motion:
    """The recording with the valid samples of one signal changed."""
    columns = motion.columns.copy()
    column = columns[:, motion.signals.index(signal)]
    is_valid = np.isfinite(column)
    column[is_valid] = change(column[is_valid])
    return replace(motion, columns=columns)


def every_tenth(x: F64) -> F64:
    return np.where(np.arange(len(x)) % 10 == 0, x, np.nan)


def stuck_for_ten_seconds(x: F64) -> F64:
    share = np.arange(len(x)) / len(x) * DURATION_S
    return np.where((share >= 40.0) & (share < 50.0), 0.05, x)


def on_glass(motion: Motion) -> Motion:
    """The recording with a twentieth of the motion."""
    for signal in (ACCELERATION, PITCH_RATE, ROLL_RATE):
        motion = with_samples(motion, signal, lambda x: np.mean(x) + 0.05 * (x - np.mean(x)))
    return motion


SPOILT: dict[str, tuple[Callable[[Motion], Motion], list[str]]] = {
    "nothing": (lambda m: m, []),
    "pitch rate turned": (lambda m: scaled(m, pitch_rate=-1.0), ["fault:pitch_rate_sign"]),
    "acceleration turned": (lambda m: scaled(m, vertical_acceleration=-1.0), ["fault:acceleration_sign"]),
    "both turned": (
        lambda m: scaled(m, vertical_acceleration=-1.0, pitch_rate=-1.0),
        ["fault:acceleration_sign", "fault:pitch_rate_sign"],
    ),
    "g for m/s2": (lambda m: scaled(m, vertical_acceleration=1.0 / G), ["fault:acceleration_unit"]),
    "m/s2 for g": (lambda m: scaled(m, vertical_acceleration=G), ["fault:acceleration_unit"]),
    "mg for m/s2": (lambda m: scaled(m, vertical_acceleration=1000.0 / G), ["fault:acceleration_unit"]),
    "g for m/s2, turned": (lambda m: scaled(m, vertical_acceleration=-1.0 / G), ["fault:acceleration_unit"]),
    "deg/s for rad/s": (lambda m: scaled(m, pitch_rate=DEGREES), ["fault:pitch_rate_unit"]),
    "deg/s for rad/s, turned": (
        lambda m: scaled(m, pitch_rate=-DEGREES),
        ["fault:pitch_rate_unit", "fault:pitch_rate_sign"],
    ),
    "level axis": (lambda m: exchanged(m, ACCELERATION, Signal.LONGITUDINAL_ACCELERATION), ["fault:acceleration_axis"]),
    "channels swapped": (lambda m: exchanged(m, ACCELERATION, PITCH_RATE), ["fault:channels_swapped"]),
    "channels swapped, as deg/s": (
        lambda m: exchanged(m, ACCELERATION, PITCH_RATE, 1.0 / DEGREES),
        ["fault:channels_swapped"],
    ),
    "rates swapped": (lambda m: exchanged(m, PITCH_RATE, ROLL_RATE), ["fault:rates_swapped"]),
    "rates swapped, one turned": (lambda m: exchanged(m, PITCH_RATE, ROLL_RATE, -1.0), ["fault:rates_swapped"]),
    "roll as deg/s for rad/s": (lambda m: scaled(m, roll_rate=DEGREES), ["fault:roll_rate_unit"]),
    "roll as rad/s for deg/s": (lambda m: scaled(m, roll_rate=1.0 / DEGREES), ["fault:roll_rate_unit"]),
    "pitch and roll turned": (lambda m: scaled(m, pitch_rate=-1.0, roll_rate=-1.0), ["fault:pitch_rate_sign"]),
    "no roll rate": (lambda m: without(m, ROLL_RATE), ["warning:sensor_silent"]),
    "no pitch rate": (lambda m: without(m, PITCH_RATE), ["fault:sensor_silent"]),
    "no speed": (lambda m: without(m, Signal.SPEED), ["fault:speed_missing"]),
    "km/h for m/s": (lambda m: scaled(m, speed=3.6), ["fault:speed_outside_gate"]),
    "m/s for km/h": (lambda m: scaled(m, speed=1.0 / 3.6), ["fault:speed_outside_gate"]),
    "km/h for mph": (lambda m: scaled(m, speed=1.609344), ["fault:speed_unit"]),
    "mph for km/h": (lambda m: scaled(m, speed=1.0 / 1.609344), ["fault:speed_unit"]),
    "speed at zero": (lambda m: scaled(m, speed=0.0), ["fault:speed_frozen"]),
    "a slow roll rate": (lambda m: with_samples(m, ROLL_RATE, every_tenth), ["warning:rate_low"]),
    "a roll rate that fails": (lambda m: with_samples(m, ROLL_RATE, stuck_for_ten_seconds), ["warning:roll_rate_lost"]),
    "a biased gyro": (lambda m: with_samples(m, PITCH_RATE, lambda x: x + BIAS_RADPS), ["warning:pitch_rate_bias"]),
    "a biased gyro, turned": (  # the fault comes first
        lambda m: with_samples(m, PITCH_RATE, lambda x: BIAS_RADPS - x),
        ["fault:pitch_rate_sign", "warning:pitch_rate_bias"],
    ),
    "a smooth road": (on_glass, ["warning:smooth_road"]),
}


@pytest.mark.parametrize("mistake", SPOILT)
def test_each_mistake_gets_only_its_own_diagnosis(mistake: str, sound: Motion) -> None:
    spoil, expected = SPOILT[mistake]
    verdict = verdict_on(spoil(sound), EMPTY, traits_of_reference())
    assert kinds(verdict) == expected
    assert verdict.is_usable is not any(kind.startswith("fault") for kind in expected)
    assert all(finding.text and finding.advice for finding in verdict.findings)


@pytest.mark.parametrize(
    ("mapped", "kind"),
    [
        ({"gyro_axis": 0}, "pitch_rate_axis"),
        ({"gyro_axis": 2}, "pitch_rate_axis"),
        ({"rolls_about": 1}, "roll_rate_axis"),
        ({"rolls_about": 2}, "roll_rate_axis"),
    ],
)
def test_another_axis_mapped_as_pitch_or_roll_is_named(mapped: dict[str, int], kind: str) -> None:
    motion = driven(PAPER_VAN, steady(), REAR_M, **mapped)
    assert kinds(verdict_on(motion, EMPTY, traits_of_reference())) == [f"fault:{kind}"]


@pytest.mark.parametrize("place", [-0.1, 0.5, 1.15])
@pytest.mark.parametrize("name", VANS)
def test_sign_and_place_are_right_for_every_sensor_position(name: str, place: float) -> None:
    van = VANS[name]
    position_m = place * van.wheelbase_m
    load = (0.8 * van.rated_payload_kg, 0.8 * van.wheelbase_m)
    motion = driven(van, steady(), position_m, Load(*load))
    vehicle = stated(van, position_m)
    assert kinds(verdict_on(motion, vehicle, traits_of_reference(), load)) == []
    turned = scaled(motion, pitch_rate=-1.0)
    assert kinds(verdict_on(turned, vehicle, traits_of_reference(), load)) == ["fault:pitch_rate_sign"]


def test_a_sensor_amidships_in_town_is_believed() -> None:
    """Speed changes make heave and pitch all but independent there, and their coherence low."""
    position_m = 0.5 * PAPER_VAN.wheelbase_m
    motion = driven(PAPER_VAN, urban(300.0, np.random.default_rng(3)), position_m)
    verdict = verdict_on(motion, stated(PAPER_VAN, position_m), traits_of_reference(), window_s=60.0)
    assert "fault:pitch_rate_axis" not in kinds(verdict)
    assert "fault:pitch_rate_sign" not in kinds(verdict)


@pytest.mark.parametrize(("stated_m", "expected"), [(3.0, []), (2.4, ["warning"]), (0.0, ["fault"])])
def test_a_wrong_sensor_position_is_reported_with_the_right_one(
    stated_m: float, expected: list[str], sound: Motion
) -> None:
    verdict = verdict_on(sound, stated(PAPER_VAN, stated_m), traits_of_reference())
    assert kinds(verdict) == [f"{severity}:sensor_position" for severity in expected]
    for finding in verdict.findings:
        assert f"is {stated_m:g}, the spectra say 3.2" in finding.text


def test_a_position_that_is_only_guessed_is_not_held_against_the_fitter(sound: Motion) -> None:
    guessed = replace(stated(PAPER_VAN, 2.4), sensor_position_std_m=0.7)
    assert kinds(verdict_on(sound, guessed, traits_of_reference())) == []


def test_coarse_steps_are_a_warning(sound: Motion) -> None:
    step_mps2 = 2.0
    columns = sound.columns.copy()
    columns[:, 0] = step_mps2 * np.round(columns[:, 0] / step_mps2)
    coarse = with_resolution(traits_of_reference(), ACCELERATION, step_mps2)
    verdict = verdict_on(replace(sound, columns=columns), EMPTY, coarse)
    assert "warning:coarse_resolution" in kinds(verdict)
    assert kinds(verdict_on(sound, EMPTY, with_resolution(traits_of_reference(), ACCELERATION, 0.1))) == []


TRAITS = traits_of_reference()


def rate_kinds(motion: Motion) -> list[str]:
    rates = (Kind.SENSOR_SILENT, Kind.RATE_LOW, Kind.JITTER)
    return [str(finding.kind) for finding in told_of(rates, facts=row_facts(motion, TRAITS))]


def told_of(kinds: tuple[Kind, ...], facts: RowFacts | None = None, log: LogFacts | None = None) -> tuple[Finding, ...]:
    """Findings of these kinds about a run without batches."""
    nothing = known_drive(1, "a.log", 0.0, 50.0, ())
    split = InspectedRun(nothing, facts=facts or RowFacts(), log=log or LogFacts())
    return inspect_run(split, VAN, BatchSettings(), kinds)


def test_stamps_in_bursts_are_named() -> None:
    motion = drive(30.0)
    since_ns = motion.t_ns - T0_NS
    burst_ns = 30_000_000
    in_burst_ns = since_ns % burst_ns // 100  # three samples of each sensor, a tenth of a millisecond apart
    bursts = replace(motion, t_ns=T0_NS + since_ns // burst_ns * burst_ns + in_burst_ns)
    assert rate_kinds(bursts) == ["jitter", "jitter"]


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
    found = told_of((Kind.SIGNAL_UNMAPPED,), facts=row_facts(mapped, TRAITS))
    assert [f"{finding.severity}: {finding.text}" for finding in found] == said


def test_lost_frames_are_a_warning() -> None:
    motion = without_rows(drive(130.0), 30.0, 36.0)
    assert "warning:gaps" in kinds(verdict_on(motion, stated(PAPER_VAN, 3.2), TRAITS))


def test_a_drive_that_is_kept_for_validation_has_lost_nothing_that_it_has() -> None:
    settings = BatchSettings(window_s=120.0)
    motion = driven(PAPER_VAN, steady(), REAR_M)
    scheduler = Scheduler(settings, TRAITS)
    batches = tuple(
        replace(one, shares={Why.TOO_SLOW: 0.45, Why.SPEED_MISSING: 0.3})
        for one in (*scheduler.feed(motion), *scheduler.flush())
    )
    assert not all(one.rejected for one in batches)
    nothing = known_drive(1, "a.log", 0.0, 50.0, ())
    kept = InspectedRun(nothing, batches, has_identification=False)
    assert not [one for one in inspect_run(kept, EMPTY, settings) if one.severity is Severity.FAULT]


SOUND = LogFacts("a" * 64, "c" * 64, 900.0, 0.0, (0, 900))
UNLADEN, LOADED = (0.0, 50.0), (420.0, 58.0)


@pytest.mark.parametrize(
    ("other", "load", "numbers"),
    [
        (SOUND, UNLADEN, [2]),  # tells nothing new
        (SOUND, LOADED, [1, 2]),  # one of the loads is wrong, and nobody knows which
        (replace(SOUND, span_ns=(600, 1500)), LOADED, [1, 2]),
        (replace(SOUND, span_ns=(900, 1800)), LOADED, []),  # the next piece of the same log
        (replace(SOUND, sha256="b" * 64), LOADED, [1, 2]),  # packed, or converted to another format
        (replace(SOUND, samples="d" * 64), LOADED, []),
        (LogFacts(unreadable="gone"), LOADED, []),
    ],
)
def test_two_runs_on_one_drive_are_found(other: LogFacts, load: tuple[float, float], numbers: list[int]) -> None:
    runs = [known_drive(1, "a.log", *UNLADEN, ()), known_drive(2, "b.log", *load, ())]
    split = [InspectedRun(run, log=log) for run, log in zip(runs, (SOUND, other), strict=True)]
    found = inspect_drives(split, VAN, BatchSettings()).runs
    told = {one.run.number: f.text for one in found for f in one.findings if f.kind is Kind.SAME_DRIVE}
    assert list(told) == numbers
    assert all("runs 1 and 2" in text for text in told.values())


def test_an_unreadable_log_is_reported_once_and_a_load_beyond_the_range_is_doubted() -> None:
    nothing = known_drive(1, "a.log", 4200.0, 60.0, ())
    unreadable = InspectedRun(nothing, log=LogFacts(unreadable="a.log: holds no CAN frame"))
    (verdict,) = inspect_drives([unreadable], VAN, BatchSettings()).runs
    assert [finding.kind for finding in verdict.findings] == [Kind.LOG_UNREADABLE, Kind.LOAD_BEYOND_RANGE]
    assert not verdict.is_usable
