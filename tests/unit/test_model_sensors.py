"""A sensor that is not where, or what, it was: what is found, what is weighed in spite of it, and what is refused."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, sosfilt
from support.model_road import RATE_HZ
from support.taught_van import ROLL, car, drive_of, estimated, left_of, lost, taught, weighed

from gateway.estimates.batch_estimate import Estimate
from gateway.model.checks import Signs, disbelieved, unseen_of
from gateway.model.table import INDEX, N
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64, Batch, Why

LOAD = (200.0, 50.0)
DENSITY = 8.7e-4  # rad/s/sqrt(Hz): a gyro of 0.05 deg/s/sqrt(Hz)


def told(batch: Batch, *, with_roll: bool = False) -> Estimate:
    return estimated(batch, taught(with_roll=with_roll))


def holds(found: Estimate, load: tuple[float, float] = LOAD) -> bool:
    ends = found.payload.interval95, found.front_share.interval95
    return all(low <= one <= high for one, (low, high) in zip(load, ends, strict=True))


REFUSED_AS_CHANGED = {Why.SENSOR_CHANGED, Why.MODEL_MISFIT}
CLEAN = 0.0
"""The slack of drives whose sensors are as alike as a model can have them, but for noise."""


@pytest.mark.parametrize(
    ("moved_m", "with_roll"),
    [
        (-0.3, False),
        (-0.2, False),
        pytest.param(-0.1, False, marks=lost("weighed, its front share 1.1 % too small")),
        pytest.param(0.1, False, marks=lost("weighed, its front share 1.2 % too large")),
        (0.2, False),
        (0.3, False),
        (-0.3, True),
        (-0.2, True),
        pytest.param(-0.1, True, marks=lost("weighed, its front share 1.0 % too small")),
        pytest.param(0.1, True, marks=lost("weighed, its front share 1.2 % too large")),
        pytest.param(0.2, True, marks=lost("weighed, its front share 3.1 % too large")),
        (0.3, True),
    ],
)
def test_a_sensor_moved_along_the_vehicle_is_refused(moved_m: float, with_roll: bool) -> None:
    theta = car(with_roll=with_roll)
    theta[INDEX["sensor_position_m"]] += moved_m
    found = told(drive_of(LOAD, 61, with_roll=with_roll, theta=theta), with_roll=with_roll)
    assert set(found.rejected) & REFUSED_AS_CHANGED
    assert np.sign(found.diagnostics["sensor_position_deviation"]) == np.sign(moved_m)


@pytest.mark.parametrize("changed", [{"sensor_left_m": 0.5}, {"sensor_left_m": 0.1}, {"gyro_yaw_rad": 0.15}], ids=str)
def test_roll_shows_a_sensor_moved_sideways_or_turned(changed: dict[str, float]) -> None:
    theta = car(with_roll=True, **changed)
    assert told(drive_of(LOAD, 62, with_roll=True, theta=theta), with_roll=True).rejected == (Why.SENSOR_CHANGED,)


@pytest.mark.parametrize("changed", [{"sensor_left_m": 0.32}, {"gyro_yaw_rad": 0.03}], ids=str)
def test_a_sensor_nearly_where_it_was_is_believed(changed: dict[str, float]) -> None:
    found = told(drive_of(LOAD, 62, with_roll=True, theta=car(with_roll=True, **changed)), with_roll=True)
    assert found.counted, found.rejected
    assert holds(found)


def heard(std_mps2: float, *, with_roll: bool, slack: float) -> Batch:
    """A drive whose accelerometer reads something else beside, within the band that is weighed."""
    batch = drive_of(LOAD, 62, with_roll=with_roll, slack=slack)
    other = std_mps2 * np.random.default_rng(62).standard_normal(len(batch.usable))
    low_passed = sosfilt(butter(6, 14.0, fs=RATE_HZ, output="sos"), other)
    return replace(batch, vertical_acceleration_mps2=batch.vertical_acceleration_mps2 + low_passed)


@pytest.mark.parametrize(
    ("std_mps2", "with_roll"),
    [
        pytest.param(0.15, False, marks=lost("weighed, 174 +- 23 kg for 200")),
        pytest.param(0.3, False, marks=lost("weighed, 166 +- 24 kg for 200")),
        (0.15, True),
        pytest.param(0.3, True, marks=lost("weighed, 182 +- 15 kg for 200")),
    ],
)
def test_vibration_from_elsewhere_is_reported_as_noise(std_mps2: float, with_roll: bool) -> None:
    """As roll does where the sensor was moved sideways: a hundred times the accelerometer's noise."""
    batch = heard(std_mps2, with_roll=with_roll, slack=CLEAN)
    assert estimated(batch, taught(with_roll=with_roll, slack=CLEAN)).rejected == (Why.SENSOR_CHANGED,)


def signs(**seen: object) -> Signs:
    """The signs of a healthy answer with these changes."""
    healthy = {
        "model": taught(),
        "misfit": 1.0,
        "followed": 1.0,
        "unseen": 1.0,
        "reach": 0.0,
        "is_reversed": False,
        "off": np.zeros(N),
        "deviations": np.zeros(N),
        "tension": 10.0,
        "loudness": np.ones(2),
        "is_mount_changed": False,
        "is_settled": True,
        "payload_std_kg": 20.0,
        "rivalry": 0.1,
    }
    return Signs(**(healthy | seen))  # type: ignore[arg-type] # any field


def off(name: str, by: float) -> F64:
    found = np.zeros(N)
    found[INDEX[name]] = by
    return found


@pytest.mark.parametrize(
    ("seen", "why"),
    [
        ({"is_reversed": True}, Why.WRONG_SIGN),
        ({"misfit": 1e6}, Why.MODEL_MISFIT),
        ({"misfit": float("nan")}, Why.MODEL_MISFIT),
        ({"is_mount_changed": True}, Why.SENSOR_CHANGED),
        ({"off": off("noise_pitch_rate_rad2ps", np.log(4.0))}, Why.SENSOR_CHANGED),
        ({"off": off("gyro_lag_s", 0.05)}, Why.SENSOR_CHANGED),
        ({"off": off("gyro_lag_s", -0.05)}, Why.SENSOR_CHANGED),
        ({"deviations": off("sensor_position_m", -9.0)}, Why.SENSOR_CHANGED),
        ({"deviations": off("sensor_position_m", 9.0)}, Why.SENSOR_CHANGED),
        ({"deviations": off("sensor_position_m", 9.0), "reach": 0.1}, Why.MODEL_MISFIT),
        ({"deviations": off("noise_acceleration_m2ps3", 9.0)}, Why.SENSOR_CHANGED),
        ({"deviations": off("noise_acceleration_m2ps3", 9.0), "reach": 0.1}, Why.MODEL_MISFIT),
        ({"tension": 100.0}, Why.MODEL_MISFIT),
        ({"is_settled": False}, Why.NO_SOLUTION),
        ({"payload_std_kg": 400.0, "rivalry": 2.0}, Why.AMBIGUOUS),
        ({"payload_std_kg": 400.0}, Why.TOO_UNCERTAIN),
    ],
)
def test_each_sign_refuses_with_its_reason(seen: dict[str, object], why: Why) -> None:
    assert disbelieved(signs(**seen)) is why


@pytest.mark.parametrize(
    "seen",
    [
        {"deviations": off("noise_acceleration_m2ps3", -9.0)},  # quieter
        {"deviations": off("spring_front_npm", 9.0)},  # the tension's
        {"off": off("noise_pitch_rate_rad2ps", -9.0)},
        {"off": off("noise_pitch_rate_rad2ps", np.log(4.0)), "loudness": np.array([1.0, 2.0])},  # the gyro itself
        {"off": off("gyro_lag_s", 0.02)},
        {"rivalry": 5.0},  # peaks near to each other
        {"reach": 0.3, "is_mount_changed": False},
    ],
    ids=str,
)
def test_harmless_signs_refuse_nothing(seen: dict[str, object]) -> None:
    assert disbelieved(signs(**seen)) is None


SEEN_MPS = (10.0, 20.0)


@pytest.mark.parametrize(
    ("speed_mps", "shaken", "reach", "factor"),
    [
        (14.0, 1.0, 0.0, 1.0),
        (10.0 * np.exp(-0.5), 1.0, 0.0, 2.0**0.5),
        (20.0 * np.exp(0.5), 1.0, 0.0, 2.0**0.5),
        (14.0, np.exp(0.5), 0.0, 2.0**0.5),
        (14.0, np.exp(-0.5), 0.0, 2.0**0.5),
        (14.0, 1.0, 0.25, 2.0**0.5),
        (20.0 * np.exp(0.5), np.exp(0.5), 0.25, 2.0),
    ],
)
def test_each_distance_from_the_teaching_drives_adds_to_the_variance(
    speed_mps: float, shaken: float, reach: float, factor: float
) -> None:
    model = replace(taught(), speed_seen_mps=SEEN_MPS)
    assert unseen_of(speed_mps, shaken * model.acceleration_rms_mps2, reach, model) == pytest.approx(factor)


def amplified(batch: Batch, gain: float) -> Batch:
    """Another gain of the accelerometer shows in what it reads of gravity too."""
    return replace(
        batch,
        vertical_acceleration_mps2=gain * batch.vertical_acceleration_mps2,
        gravity_mps2=gain * batch.gravity_mps2,
    )


def test_a_changed_reading_of_gravity_is_refused() -> None:
    assert taught().gravity_mps2 == pytest.approx(9.81)
    for gain in (0.95, 1.05):
        assert told(amplified(drive_of(LOAD, 63), gain)).rejected == (Why.SENSOR_CHANGED,)


@ROLL
def test_a_little_more_gain_is_within_the_interval(with_roll: bool) -> None:
    batch = drive_of(LOAD, 64, with_roll=with_roll)
    as_it_was, stronger = (told(amplified(batch, gain), with_roll=with_roll) for gain in (1.0, 1.01))
    assert stronger.counted, stronger.rejected
    assert abs(stronger.payload.number - as_it_was.payload.number) < as_it_was.payload.std
    assert holds(stronger)


def test_a_vehicle_that_does_not_know_its_gravity_has_no_fault() -> None:
    batch = drive_of(LOAD, 65)
    one, other = (estimated(batch, model) for model in (taught(), replace(taught(), gravity_mps2=None)))
    assert one.counted
    assert other.counted
    assert other.payload.number == pytest.approx(one.payload.number, abs=1.0)
    assert estimated(amplified(batch, 1.05), replace(taught(), gravity_mps2=None)).counted


@pytest.mark.parametrize(("gain", "is_refused"), [(1.01, False), (1.05, True), (0.95, True), (None, False)])
def test_a_changed_gyro_gain_in_bends_is_reported(gain: float | None, is_refused: bool) -> None:
    model = replace(taught(), gyro_gain=(1.0, 0.002))
    batch = replace(drive_of(LOAD, 63), gyro_gain=None if gain is None else (gain, 0.008))
    assert estimated(batch, model).rejected == ((Why.SENSOR_CHANGED,) if is_refused else ())
    assert estimated(batch, model).diagnostics.get("gyro_gain_ratio") == gain
    assert told(batch).counted  # by a vehicle that knows no gain


LATE = lost("reads 18 kg less")


@pytest.mark.parametrize(
    ("lag_s", "with_roll"),
    [
        (-0.02, False),
        (-0.005, False),
        (0.005, False),
        pytest.param(0.02, False, marks=LATE),
        (-0.02, True),
        (-0.005, True),
        (0.005, True),
        pytest.param(0.02, True, marks=LATE),
    ],
)
def test_a_lag_between_the_sensors_costs_nothing(lag_s: float, with_roll: bool) -> None:
    late = car(with_roll=with_roll, gyro_lag_s=lag_s)
    prompt = told(drive_of(LOAD, 66, with_roll=with_roll), with_roll=with_roll)
    found = told(drive_of(LOAD, 66, with_roll=with_roll, theta=late), with_roll=with_roll)
    assert found.counted, found.rejected
    assert found.payload.number == pytest.approx(prompt.payload.number, abs=6.0)
    assert found.front_share.number == pytest.approx(prompt.front_share.number, abs=0.4)


def late_by(lag_s: float, *, with_roll: bool) -> Estimate:
    theta = car(with_roll=with_roll, gyro_lag_s=lag_s)
    return told(drive_of(LOAD, 66, with_roll=with_roll, theta=theta), with_roll=with_roll)


@ROLL
@pytest.mark.parametrize("lag_s", [-0.05, 0.05])
def test_a_gyro_that_is_far_too_late_is_refused(lag_s: float, with_roll: bool) -> None:
    assert set(late_by(lag_s, with_roll=with_roll).rejected) & REFUSED_AS_CHANGED


def noisy(density: float, *, with_roll: bool = False) -> Batch:
    """A drive whose gyro adds white noise of this density to its pitch rate."""
    batch = drive_of(LOAD, 60, with_roll=with_roll)
    noise = density * np.sqrt(RATE_HZ / 2.0) * np.random.default_rng(60).standard_normal(len(batch.usable))
    return replace(batch, pitch_rate_radps=batch.pitch_rate_radps + noise)


@ROLL
def test_a_noisy_gyro_widens_the_interval(with_roll: bool) -> None:
    model = taught(with_roll=with_roll)
    quiet, loud = (estimated(noisy(density, with_roll=with_roll), model) for density in (0.0, 3.0 * DENSITY))
    assert loud.counted, loud.rejected
    assert holds(loud)
    assert loud.posterior.own[0, 0] > quiet.posterior.own[0, 0]
    assert quiet.diagnostics["noise_pitch_rate_ratio"] < 1.5
    assert loud.diagnostics["noise_pitch_rate_ratio"] > 2.0
    assert loud.diagnostics["noise_acceleration_ratio"] < 1.5
    assert loud.diagnostics["misfit"] < 0.8 * model.misfit_limit


def test_a_vehicle_that_does_not_know_its_floor_cannot_weigh_a_noisy_gyro() -> None:
    deaf = replace(taught(), floor=None)
    assert not estimated(noisy(3.0 * DENSITY), deaf).counted
    quiet = noisy(0.0)
    assert estimated(quiet, deaf).payload.number == told(quiet).payload.number


@ROLL
def test_noise_that_drowns_the_vehicle_is_named(with_roll: bool) -> None:
    assert told(noisy(300.0 * DENSITY, with_roll=with_roll), with_roll=with_roll).rejected == (Why.SENSOR_NOISY,)


def _silent(batch: Batch) -> Batch:
    return replace(
        batch,
        vertical_acceleration_mps2=1e-3 * batch.vertical_acceleration_mps2,
        pitch_rate_radps=1e-3 * batch.pitch_rate_radps,
    )


def _never_steady(batch: Batch) -> Batch:
    t_s = np.arange(len(batch.speed_mps)) / batch.rate_hz
    return replace(batch, speed_mps=14.0 + 6.0 * np.sin(t_s))


def _mostly_masked(batch: Batch) -> Batch:
    return replace(batch, usable=np.arange(len(batch.usable)) < 500)


def _with_lost_frames(batch: Batch) -> Batch:
    """Three frames in ten, one after the other here and there."""
    usable = np.arange(len(batch.usable)) % 200 < 140
    return replace(batch, usable=usable, shares={Why.TOO_SLOW: 0.0, Why.GAP: 0.3})


def _slow_now_and_then(batch: Batch) -> Batch:
    return replace(_with_lost_frames(batch), shares={Why.TOO_SLOW: 0.28, Why.GAP: 0.02})


def _without_pitch_rate(batch: Batch) -> Batch:
    return replace(batch, pitch_rate_radps=np.full(len(batch.pitch_rate_radps), np.nan))


def _without_acceleration(batch: Batch) -> Batch:
    return replace(batch, vertical_acceleration_mps2=np.full(len(batch.usable), np.nan))


def _unrelated(batch: Batch) -> Batch:
    noise = np.random.default_rng(1).standard_normal(len(batch.pitch_rate_radps))
    return replace(batch, pitch_rate_radps=batch.pitch_rate_radps.std() * noise)


def _unrelated_and_quiet_above(batch: Batch) -> Batch:
    quiet = sosfilt(
        butter(6, 14.0, fs=RATE_HZ, output="sos"), np.random.default_rng(1).standard_normal(len(batch.usable))
    )
    return replace(batch, pitch_rate_radps=batch.pitch_rate_radps.std() * quiet)


def _reversed(batch: Batch) -> Batch:
    return replace(batch, pitch_rate_radps=-batch.pitch_rate_radps)


def _gyro_on_another_axis(batch: Batch) -> Batch:
    """Coherent with the acceleration, but not as any pitching half-car is, and as quiet above what is weighed."""
    low_passed = butter(4, 14.0, fs=batch.rate_hz, output="sos")
    return replace(batch, pitch_rate_radps=sosfilt(low_passed, np.roll(batch.vertical_acceleration_mps2, 9)) * 0.02)


@ROLL
@pytest.mark.parametrize(
    ("spoil", "why"),
    [
        (_silent, Why.NOT_ENOUGH_EXCITATION),
        (_never_steady, Why.SPEED_SPREAD),
        (_mostly_masked, Why.TOO_SHORT),
        (_with_lost_frames, Why.GAP),
        (_slow_now_and_then, Why.TOO_SLOW),
        (_without_pitch_rate, Why.PITCH_RATE_MISSING),
        (_without_acceleration, Why.ACCELERATION_MISSING),
        (_unrelated, Why.SENSOR_NOISY),
        (_unrelated_and_quiet_above, Why.SENSOR_DISAGREEMENT),
        (_reversed, Why.WRONG_SIGN),
        (_gyro_on_another_axis, Why.MODEL_MISFIT),
    ],
)
def test_a_batch_with_a_faulty_sensor_is_refused_with_the_reason(
    spoil: Callable[[Batch], Batch], why: Why, with_roll: bool
) -> None:
    found = told(spoil(drive_of(LOAD, 4, with_roll=with_roll)), with_roll=with_roll)
    assert found.rejected == (why,)
    assert np.isnan(found.payload.number)
    assert np.isnan(found.front_share.number)


def test_a_lost_roll_rate_leaves_a_weight_without_a_place() -> None:
    model = taught(with_roll=True)
    whole = drive_of(LOAD, 67, with_roll=True)
    with_roll, without = (estimated(one, model) for one in (whole, replace(whole, roll_rate_radps=None)))
    assert np.isfinite(with_roll.cg_left.number)
    assert abs(with_roll.cg_left.number - left_of(LOAD[0])) < 0.01
    assert without.counted, without.rejected
    assert np.isnan(without.cg_left.number)
    assert without.payload.std > with_roll.payload.std
    assert holds(without)


def test_a_load_that_may_lie_on_either_side_of_a_sensor_off_the_line_is_less_sure() -> None:
    """Without a roll rate, and by symmetry not of a sensor on the centre line."""
    batch = replace(drive_of(LOAD, 68, with_roll=True), roll_rate_radps=None)

    def sideways_kg(model: VehicleModel) -> float:
        return float(np.linalg.norm(weighed(batch, model).posterior.sources["sideways"][:, 0]))

    far = taught(with_roll=True)
    central = far.parameters.copy()
    central[INDEX["sensor_left_m"]] = 0.0
    near = replace(far, parameters=central, sensor_left_m=0.0, sensor_left_std_m=1e-6)
    off_line = sideways_kg(far)
    assert off_line > 5.0 * sideways_kg(near)
    assert off_line > 1.0


def test_a_roll_rate_changes_nothing_for_a_vehicle_taught_without_one() -> None:
    batch = drive_of(LOAD, 69, with_roll=True)
    one, other = (estimated(each, taught()) for each in (batch, replace(batch, roll_rate_radps=None)))
    assert one.payload == other.payload
    assert one.front_share == other.front_share
    assert np.isnan(one.cg_left.number)
