"""A report of a vehicle that was calibrated with a roll rate: what it knows of its roll, and of places to the side."""

from dataclasses import replace

import numpy as np
import pytest
from support.estimates import make_estimate
from support.half_car_road import VAN

from gateway.calibration.half_car.prior import prior_of
from gateway.calibration.judgement.assessment import BatchSet, Judgement
from gateway.calibration.judgement.evaluation import CgLeftErrors, Errors, ErrorTable, Judged, TargetErrors, WheelErrors
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, ROLL_PARAMETERS, has_roll, names_of
from gateway.estimate import Quantity
from gateway.records import F64, Why
from gateway.reports.calibration.accuracy import accuracy_section
from gateway.reports.calibration.half_car import knowledge_chart, knowledge_of, knowledge_table, told

WIDE = replace(VAN, track_width_m=1.5, sensor_offset_left_m=0.3)
ROLL_PRIOR = prior_of(WIDE, with_roll=True)


def calibration(theta: F64, std: F64) -> CrossSpectrumCalibration:
    """As if a fit had ended with these parameters and standard deviations (n,)."""
    return CrossSpectrumCalibration(
        empty_mass_kg=WIDE.empty_mass_kg,
        empty_front_share_pct=WIDE.empty_front_share_pct,
        wheelbase_m=WIDE.wheelbase_m,
        band_hz=(1.1, 14.0),
        n_segment=256,
        names=names_of(theta),
        parameters=theta,
        covariance=np.diag(std**2),
        directions=np.zeros((len(theta), 0)),
        model_std=(10.0, 0.2, 0.002),
        misfit_limit=3.0,
        acceleration_rms_mps2=0.5,
        pitch_rate_rms_radps=0.05,
        payload_seen_kg=(0.0, 420.0),
        front_share_seen_pct=(40.0, 60.0),
        speed_seen_mps=(12.0, 15.0),
        track_width_m=1.5 if has_roll(theta) else None,
    )


def test_what_the_drives_told_of_roll_is_in_the_report() -> None:
    std = ROLL_PRIOR.std.copy()
    std[-1] *= 0.25
    known = knowledge_of(calibration(ROLL_PRIOR.mean, std), WIDE)
    assert [one.name for one in known] == [*PARAMETERS, *ROLL_PARAMETERS]
    assert known[-1].name == "empty_left_m"
    assert known[-1].left_over == pytest.approx(0.25)
    assert all(one.left_over == pytest.approx(1.0) for one in known[:-1])
    assert "roll_inertia_kgm2" in told(known)
    assert "empty_left_m" not in told(known)
    assert "roll" in [panel.title for panel in knowledge_chart(known).panels]
    rows = {row[0]: row for row in knowledge_table(known).rows}
    assert set(rows) == {name for name in names_of(ROLL_PRIOR.mean) if not name.startswith("slack_")}
    before = float(rows["roll_inertia_kgm2"][1])
    assert before == pytest.approx(1240.0 * (0.42 * 1.5) ** 2, rel=1e-3)  # in its unit, not its logarithm


def test_a_calibration_without_a_roll_rate_says_nothing_of_roll() -> None:
    prior = prior_of(WIDE)
    known = knowledge_of(calibration(prior.mean, prior.std), WIDE)
    assert [one.name for one in known] == list(PARAMETERS)
    assert "roll" not in [panel.title for panel in knowledge_chart(known).panels]


def judged(cg_left: CgLeftErrors | None, wheels: WheelErrors | None) -> Judgement:
    """One set: a place answered to a noted one, one to a load that nobody placed, and no weight."""
    none = TargetErrors("kg", None, None, None, None, None, None, None, None, None, None)
    errors = Errors(0, 0, {}, none, replace(none, unit="pp"), cg_left, wheels)
    told = replace(make_estimate(0, Why.TOO_SLOW), cg_left=Quantity.normal(0.01, 0.02))
    batches = (Judged(1, "1.log", 0.0, 52.0, told, 0.0), Judged(2, "2.log", 100.0, 50.0, told))
    return Judgement("cross_spectrum", {BatchSet.VALIDATION: ErrorTable("cross_spectrum", batches, errors, ())})


def test_how_well_places_to_the_side_were_told_stands_with_the_accuracy() -> None:
    found = CgLeftErrors(mean_abs_m=0.0123, bias_m=0.0, std_m=0.02, max_abs_m=0.03, coverage95=0.9)
    (sentence,) = accuracy_section(judged(found, WheelErrors(1.26, 2.0))).paragraphs[1:]
    assert "12 mm on average over 1 answer " in sentence
    assert "90 %" in sentence
    assert "1.3 % of the gross weight" in sentence
    (sentence,) = accuracy_section(judged(found, None)).paragraphs[1:]
    assert "gross weight" not in sentence


def test_no_word_of_places_that_nobody_noted_or_told() -> None:
    assert len(accuracy_section(judged(None, None)).paragraphs) == 1
    untold = CgLeftErrors(None, None, None, None, None)
    assert len(accuracy_section(judged(untold, None)).paragraphs) == 1
