"""Studies of sensors: bounds obey what information must, grades name each sensor and which is as good."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from support.half_car_road import VAN

from benchmarks.accuracy.__main__ import studies
from benchmarks.accuracy.coverage_table import JudgedBatch, coverage_table
from benchmarks.accuracy.grades import AS_GOOD, FAILS, GRADES, WORKS, _facts, grades_page, limits, verdict_of
from benchmarks.accuracy.sensor_bounds import MILD, SPEED, Scene, Seen, bound_of
from gateway.calibration.half_car.prior import prior_of
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.model.parameters import Ground
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.cross_spectrum.predicted import Drive
from gateway.sim.sensors import CANMOD, REFERENCE

TRIALS = Path(__file__).parents[2] / "benchmarks" / "accuracy" / "trials.md"
SCENE = Scene(
    point=Point(prior_of(VAN).mean, 200.0, 0.5),
    ground=Ground.of(VAN),
    reading=Reading(VAN.wheelbase_m, (1.1, 14.0), 256),
    drive=Drive(300.0, 14.0),
    road_m3=3e-6,
    slack=0.02,
)


@pytest.mark.parametrize("unknown", [{}, MILD])
def test_who_sees_more_weighs_better(unknown: dict[str, float]) -> None:
    one, two, all_of_it = (bound_of(seen, unknown, SCENE) for seen in (Seen.ACCELERATION, Seen.POWERS, Seen.BOTH))
    assert one.payload_std_kg > two.payload_std_kg > all_of_it.payload_std_kg
    assert one.front_share_std_pct > two.front_share_std_pct > all_of_it.front_share_std_pct


@pytest.mark.parametrize("seen", Seen)
def test_who_knows_less_of_the_vehicle_weighs_worse(seen: Seen) -> None:
    known, unsure = bound_of(seen, {}, SCENE), bound_of(seen, {SPEED: 0.01, "spring_rear_npm": 0.1}, SCENE)
    assert unsure.payload_std_kg > known.payload_std_kg
    assert unsure.front_share_std_pct > known.front_share_std_pct


@pytest.mark.parametrize("seen", Seen)
def test_what_is_known_almost_surely_is_known(seen: Seen) -> None:
    known, sure = bound_of(seen, {}, SCENE), bound_of(seen, {SPEED: 1e-7, "spring_rear_npm": 1e-7}, SCENE)
    assert sure.payload_std_kg == pytest.approx(known.payload_std_kg, rel=1e-3)


@pytest.mark.parametrize("seen", Seen)
def test_four_times_the_segments_halve_it(seen: Seen) -> None:
    segment_s = SCENE.reading.n_segment / 50.0
    short = bound_of(seen, {}, replace(SCENE, drive=Drive(20.5 * segment_s, 14.0)))  # 40 half-overlapping segments
    long = bound_of(seen, {}, replace(SCENE, drive=Drive(80.5 * segment_s, 14.0)))
    assert long.payload_std_kg == pytest.approx(short.payload_std_kg / 2.0, rel=1e-9)


@pytest.mark.parametrize("seen", Seen)
def test_the_roads_level_does_not_matter_without_noise(seen: Seen) -> None:
    rough = bound_of(seen, MILD, replace(SCENE, road_m3=100.0 * SCENE.road_m3))
    assert rough.payload_std_kg == pytest.approx(bound_of(seen, MILD, SCENE).payload_std_kg, rel=1e-6)


def test_noise_hurts_most_on_a_smooth_road() -> None:
    noisy = replace(SCENE, noise_acceleration_m2ps3=1e-5, noise_pitch_rate_rad2ps=1e-8)
    stds = [bound_of(Seen.BOTH, {}, replace(noisy, road_m3=road)).payload_std_kg for road in (1e-8, 1e-7, 1e-6, 1e-4)]
    assert np.all(np.diff(stds) < 0.0)
    assert stds[-1] > bound_of(Seen.BOTH, {}, SCENE).payload_std_kg


def test_without_slack_or_noise_nothing_would_limit_the_full_matrix() -> None:
    """A matrix of rank one tells the vehicle exactly: the bound goes with the root of the slack."""
    some = bound_of(Seen.BOTH, {}, replace(SCENE, slack=1e-4)).payload_std_kg
    less = bound_of(Seen.BOTH, {}, replace(SCENE, slack=1e-6)).payload_std_kg
    assert less == pytest.approx(0.1 * some, rel=0.05)


def test_the_page_shows_what_the_command_prints() -> None:
    printed = CliRunner().invoke(studies, ["bounds"], catch_exceptions=False)
    assert printed.exit_code == 0
    assert printed.stdout in TRIALS.read_text(encoding="utf-8")


SAME = JudgedBatch(
    "van",
    "run",
    "",
    "cross_spectrum",
    (),
    2.0,
    1.0,
    True,
    True,
    payload_half_width_pct=6.0,
    payload_score_pct=12.0,
    front_share_half_width_pct=3.0,
    front_share_score_pct=6.0,
)


def found(**changed: Any) -> dict[str, Any]:
    """Ten batches of every sensor, all the same but for ``noise``: what a batch of that sensor is instead."""
    batches = [
        replace(SAME, kind=name, run=f"{name} {i}", **changed.get(_word(name), {}))
        for name in GRADES
        for i in range(10)
    ]
    sensors = [{"name": name, **_facts(sensors_of(REFERENCE))} for name, sensors_of in GRADES.items()]
    return {"grades": sensors, **coverage_table(batches, 1)}


def _word(name: str) -> str:
    """accelerometer's noise x 5: accel_5."""
    return f"{name.split(maxsplit=1)[0][:5]}_{name.rpartition(' ')[2]}"


def test_a_noisier_sensor_differs_in_its_noise_alone() -> None:
    both = GRADES["both x 5"](REFERENCE)
    assert both.imu.accel.noise_density == pytest.approx(5.0 * REFERENCE.imu.accel.noise_density)
    assert both.imu.gyro.noise_density == pytest.approx(5.0 * REFERENCE.imu.gyro.noise_density)
    alone = GRADES["gyro's noise x 20"](REFERENCE)
    assert alone.imu.accel == REFERENCE.imu.accel
    assert replace(alone, imu=REFERENCE.imu) == REFERENCE
    coarse = GRADES["resolutions of CANmod.gps"](REFERENCE)
    assert coarse.imu.accel.resolution == CANMOD.imu.accel.resolution
    assert GRADES["50 samples a second"](REFERENCE).imu.corner_hz < 25.0


def test_the_noisiest_lies_before_the_first_that_is_worse() -> None:
    told = found(
        accel_10={"payload_half_width_pct": 8.0},
        accel_20={"payload_half_width_pct": 13.0},
        **{"gyro'_2": {"front_share_error_pct": 1.3}, "gyro'_5": {"is_payload_covered": False}},
    )
    assert verdict_of(told, "accelerometer's noise x 5") == AS_GOOD
    assert verdict_of(told, "accelerometer's noise x 10") == WORKS
    assert verdict_of(told, "accelerometer's noise x 20") == FAILS
    assert verdict_of(told, "gyro's noise x 10") == AS_GOOD
    as_good, works, others = limits(told).splitlines()
    assert "up to 0.0075 m/s2/√Hz (765 µg/√Hz), gyro up to 0.00017 rad/s/√Hz (0.01 °/s/√Hz)" in as_good
    assert "up to 0.015 m/s2/√Hz (1530 µg/√Hz), gyro up to 0.00035 rad/s/√Hz (0.02 °/s/√Hz)" in works
    assert "50 samples a second (as good)" in others
    page = grades_page(told)
    assert "| accelerometer's noise x 10 | 0.015 | 0.00017 | 10 | 0 | 2.00 | 8.00 | 100 % |" in page


@pytest.mark.parametrize("n_refused", [1, 2, 3, 10])
def test_refusals_count_too(n_refused: int) -> None:
    told = found()
    line = next(line for line in told["lines"] if line["kind"] == "both x 20")
    line["n_rejected"] = n_refused
    assert verdict_of(told, "both x 20") == (AS_GOOD if n_refused == 1 else WORKS if n_refused == 2 else FAILS)


def test_a_sensor_that_answers_nothing_or_could_not_be_calibrated_does_not_work() -> None:
    told = found(both_20={"rejected": ("too_uncertain",)})
    assert verdict_of(told, "both x 20") == FAILS
    told["lines"] = [line for line in told["lines"] if line["kind"] != "both x 10"]
    assert verdict_of(told, "both x 10") == FAILS
    assert "| both x 10 | 0.015 | 0.0017 | none |" in grades_page(told)
