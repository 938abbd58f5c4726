"""One run with a load to one side is advised where a roll rate is mapped and none was driven."""

from dataclasses import replace

import numpy as np
from support.half_car_road import VAN, batch_over_road

from gateway.calibration.known_run import KnownRun
from gateway.calibration.plan.loads import PlacedLoad
from gateway.calibration.plan.plan import Advice, Expected, LoadPlan, OffCentreLoad, sideways_load
from gateway.cli.calibrate import plan_sentences
from gateway.core.cross_spectrum.predicted import Drive
from gateway.reports.calibration.runs import plan_section

STRAIGHT = batch_over_road(0.0, 52.0, seed=1, duration_s=60.0)
ROLLING = replace(STRAIGHT, roll_rate_radps=np.zeros_like(STRAIGHT.pitch_rate_radps))
WIDE = replace(VAN, track_width_m=1.6)
EXPECTED = Expected(payload_std_kg=10.0, front_share_std_pct=0.5, reach_share=0.4)


def run(payload_kg: float = 0.0, left_m: float | None = None) -> KnownRun:
    return KnownRun(1, "1.log", payload_kg, 52.0, (ROLLING,), left_m)


def test_the_heaviest_load_goes_a_quarter_of_the_track_to_one_side() -> None:
    advised = sideways_load([run(), run(300.0)], WIDE)
    assert advised is not None
    assert (advised.load.payload_kg, advised.payload_left_m) == (450.0, 0.4)
    assert abs(advised.load.front_share_pct - WIDE.empty_front_share_pct) < 2.0
    of_unknown_track = sideways_load([run()], VAN)
    assert of_unknown_track is not None
    assert of_unknown_track.payload_left_m == 0.4  # a quarter of 1.5 m, in steps of 0.05 m


def test_nothing_is_advised_without_a_roll_rate_or_after_such_a_run() -> None:
    assert sideways_load([replace(run(), batches=(STRAIGHT,))], WIDE) is None
    assert sideways_load([run(), run(300.0, -0.3)], WIDE) is None
    assert sideways_load([run(300.0, 0.05)], WIDE) is not None


def test_a_limit_of_single_wheels_bounds_the_load() -> None:
    weighed = replace(WIDE, unsprung_front_kg=80.0, unsprung_rear_kg=85.0)
    limited = replace(weighed, front_wheel_limit_kg=470.0, rear_wheel_limit_kg=470.0)
    advised = sideways_load([run()], limited)
    assert advised is not None
    assert 0.0 < advised.load.payload_kg < 450.0
    assert sideways_load([run()], replace(weighed, rear_wheel_limit_kg=300.0)) is None


def test_people_read_it() -> None:
    load = PlacedLoad(450.0, 1.4, 51.0)
    plan = LoadPlan("van", 3, Drive(600.0, 14.0), EXPECTED, (Advice(load, EXPECTED),), None)
    advised = replace(plan, sideways=OffCentreLoad(load, 0.4))
    assert "payload_left_m = 0.4 or -0.4" in plan_sentences(advised)
    assert "payload_left_m" not in plan_sentences(plan)
    assert "450 kg 0.4 m left of the centre line" in " ".join(plan_section(advised).paragraphs)
    assert advised.to_json()["sideways"] == {
        "load": {"payload_kg": 450.0, "position_m": 1.4, "front_share_pct": 51.0},
        "payload_left_m": 0.4,
    }
    assert plan.to_json()["sideways"] is None
