"""The study of sensors' noise: what each sensor is, and which the page calls as good."""

from dataclasses import replace
from typing import Any

import pytest

from benchmarks.accuracy.coverage_table import JudgedBatch, coverage_table
from benchmarks.accuracy.grades import AS_GOOD, FAILS, GRADES, WORKS, _facts, grades_page, limits, verdict_of
from gateway.sim.sensors import CANMOD, REFERENCE

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
    sensors = [{"name": name, **_facts(grade.sensors_of(REFERENCE))} for name, grade in GRADES.items()]
    return {"grades": sensors, **coverage_table(batches, 1).to_json()}


def _word(name: str) -> str:
    """accelerometer's noise x 5: accel_5."""
    return f"{name.split(maxsplit=1)[0][:5]}_{name.rpartition(' ')[2]}"


def test_a_noisier_sensor_differs_in_its_noise_alone() -> None:
    both = GRADES["both x 5"].sensors_of(REFERENCE)
    assert both.imu.accel.noise_density == pytest.approx(5.0 * REFERENCE.imu.accel.noise_density)
    assert both.imu.gyro.noise_density == pytest.approx(5.0 * REFERENCE.imu.gyro.noise_density)
    alone = GRADES["gyro's noise x 20"].sensors_of(REFERENCE)
    assert alone.imu.accel == REFERENCE.imu.accel
    assert replace(alone, imu=REFERENCE.imu) == REFERENCE
    coarse = GRADES["resolutions of CANmod.gps"].sensors_of(REFERENCE)
    assert coarse.imu.accel.resolution == CANMOD.imu.accel.resolution
    assert GRADES["50 samples a second"].sensors_of(REFERENCE).imu.corner_hz < 25.0


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
