"""Each way a drive can be spoiled gets its own diagnosis and no other, and a sound drive gets none."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
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

from gateway.calibration.inspection.finding import Severity
from gateway.records import Motion, Signal
from gateway.sim.drive import Drive, constant, urban
from gateway.sim.vans import PAPER_VAN, VANS
from gateway.sim.vehicle import Load
from gateway.units import STANDARD_GRAVITY_MPS2

DURATION_S = 130.0
REAR_M = 3.2
G = STANDARD_GRAVITY_MPS2
DEGREES = 180.0 / np.pi
EMPTY = stated(PAPER_VAN, REAR_M)


def steady(speed_mps: float = 14.0, duration_s: float = DURATION_S) -> Drive:
    return constant(speed_mps, duration_s, np.random.default_rng(1))


@pytest.fixture(scope="module")
def sound() -> Motion:
    return driven(PAPER_VAN, steady(), REAR_M)


WRONG_MAPS: dict[str, tuple[Callable[[Motion], Motion], list[str]]] = {
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
    "level axis": (
        lambda m: exchanged(m, ACCELERATION, Signal.LONGITUDINAL_ACCELERATION),
        ["fault:acceleration_axis"],
    ),
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
}


@pytest.mark.parametrize("mistake", WRONG_MAPS)
def test_a_mistake_gets_its_diagnosis_and_no_other(mistake: str, sound: Motion) -> None:
    spoil, expected = WRONG_MAPS[mistake]
    verdict = verdict_on(spoil(sound), EMPTY, traits_of_reference())
    assert kinds(verdict) == expected
    assert verdict.is_usable is not any(kind.startswith("fault") for kind in expected)
    assert all(finding.text and finding.advice for finding in verdict.findings)


@pytest.mark.parametrize("axis", [0, 2])
def test_roll_or_yaw_mapped_as_pitch_is_named(axis: int) -> None:
    motion = driven(PAPER_VAN, steady(), REAR_M, gyro_axis=axis)
    assert kinds(verdict_on(motion, EMPTY, traits_of_reference())) == ["fault:pitch_rate_axis"]


@pytest.mark.parametrize(
    ("axis", "expected"), [(1, "roll_rate_axis"), (2, "roll_rate_unit")]
)  # yaw: as small as a misread unit makes roll
def test_pitch_or_yaw_mapped_as_roll_is_named(axis: int, expected: str) -> None:
    motion = driven(PAPER_VAN, steady(), REAR_M, rolls_about=axis)
    assert kinds(verdict_on(motion, EMPTY, traits_of_reference())) == [f"fault:{expected}"]


def test_a_roll_rate_that_fails_for_a_while_is_a_warning(sound: Motion) -> None:
    columns = sound.columns.copy()
    begin, end = (int(np.searchsorted(sound.t_ns, sound.t_ns[0] + s * 10**9)) for s in (40, 50))
    column = columns[begin:end, sound.signals.index(ROLL_RATE)]
    column[np.isfinite(column)] = 0.05
    verdict = verdict_on(replace(sound, columns=columns), EMPTY, traits_of_reference())
    assert kinds(verdict) == ["warning:roll_rate_lost"]
    assert verdict.is_usable


def test_a_slow_roll_rate_is_a_warning(sound: Motion) -> None:
    columns = sound.columns.copy()
    column = columns[:, sound.signals.index(ROLL_RATE)]
    known = np.flatnonzero(np.isfinite(column))
    column[np.delete(known, np.s_[::10])] = np.nan
    assert kinds(verdict_on(replace(sound, columns=columns), EMPTY, traits_of_reference())) == ["warning:rate_low"]


@pytest.mark.parametrize("place", [-0.1, 0.5, 1.15])
@pytest.mark.parametrize("name", VANS)
def test_sign_and_place_are_right_wherever_the_sensor_sits(name: str, place: float) -> None:
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
def test_a_wrong_sensor_position_is_told_with_the_right_one(
    stated_m: float, expected: list[str], sound: Motion
) -> None:
    verdict = verdict_on(sound, stated(PAPER_VAN, stated_m), traits_of_reference())
    assert kinds(verdict) == [f"{severity}:sensor_position" for severity in expected]
    for finding in verdict.findings:
        assert f"is {stated_m:g}, the spectra say 3.2" in finding.text


def test_a_position_that_is_only_guessed_is_not_held_against_the_fitter(sound: Motion) -> None:
    guessed = replace(stated(PAPER_VAN, 2.4), sensor_position_std_m=0.7)
    assert kinds(verdict_on(sound, guessed, traits_of_reference())) == []


@pytest.mark.parametrize("duration_s", [20.0, 110.0])
def test_a_drive_shorter_than_a_batch_is_too_short(duration_s: float, sound: Motion) -> None:
    cut = sound.part(0, int(np.searchsorted(sound.t_ns, sound.t_ns[0] + int(duration_s * 1e9))))
    verdict = verdict_on(cut, EMPTY, traits_of_reference())
    assert kinds(verdict) == ["fault:too_short"]
    assert "a batch needs 114 s" in verdict.findings[0].text


def test_a_smooth_road_is_a_warning() -> None:
    still = driven(PAPER_VAN, steady(), REAR_M)
    columns = still.columns.copy()
    for i in (still.signals.index(signal) for signal in (ACCELERATION, PITCH_RATE, ROLL_RATE)):
        mean = np.nanmean(columns[:, i])
        columns[:, i] = mean + 0.05 * (columns[:, i] - mean)
    smooth = replace(still, columns=columns)
    verdict = verdict_on(smooth, EMPTY, traits_of_reference())
    assert kinds(verdict) == ["warning:smooth_road"]


def test_coarse_steps_are_a_warning(sound: Motion) -> None:
    step_mps2 = 2.0
    columns = sound.columns.copy()
    columns[:, 0] = step_mps2 * np.round(columns[:, 0] / step_mps2)
    coarse = with_resolution(traits_of_reference(), ACCELERATION, step_mps2)
    verdict = verdict_on(replace(sound, columns=columns), EMPTY, coarse)
    assert "warning:coarse_resolution" in kinds(verdict)
    assert kinds(verdict_on(sound, EMPTY, with_resolution(traits_of_reference(), ACCELERATION, 0.1))) == []


def test_a_biased_gyroscope_is_a_warning(sound: Motion) -> None:
    columns = sound.columns.copy()
    columns[:, sound.signals.index(PITCH_RATE)] += np.radians(4.0)
    verdict = verdict_on(replace(sound, columns=columns), EMPTY, traits_of_reference())
    assert kinds(verdict) == ["warning:pitch_rate_bias"]
    assert verdict.is_usable


def test_faults_come_first(sound: Motion) -> None:
    columns = sound.columns.copy()
    pitch_rate = columns[:, sound.signals.index(PITCH_RATE)]
    pitch_rate[:] = np.radians(4.0) - pitch_rate
    verdict = verdict_on(replace(sound, columns=columns), EMPTY, traits_of_reference())
    assert [finding.severity for finding in verdict.findings] == [Severity.FAULT, Severity.WARNING]
