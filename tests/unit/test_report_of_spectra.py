"""Spectra and roll in a report: the modelled spectra of a known vehicle, and what its drives told."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.half_car_road import CAR, VAN, as_if_fitted, batch_over_road

from gateway.calibration.found import FoundLoad
from gateway.calibration.judgement.assessment import BatchSet, Judgement
from gateway.calibration.judgement.evaluation import CgLeftErrors, Errors, ErrorTable, TargetErrors, WheelErrors
from gateway.calibration.stated_drive import StatedDrive, drive_name, known_drive
from gateway.calibration.teach import teach
from gateway.core.vehicle import Load
from gateway.model.table import INDEX, N_OWN, NAMES, OWN, ROWS, prior_of
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64
from gateway.reports.calibration.accuracy import summary_table
from gateway.reports.calibration.fitted_vehicle import RunFit, fits_of, knowledge_of, knowledge_table, told


def run_of(kg: float, pct: float, number: int = 1, **how: Any) -> StatedDrive:
    return known_drive(number, f"{number}.log", kg, pct, (batch_over_road(kg, pct, number, 200.0, **how),))


def differences(fit: RunFit) -> tuple[F64, F64]:
    """Logarithm of modelled over measured amplitudes, and their difference of phase where they are coherent."""
    logs = [
        np.log(getattr(fit.modelled, sensor) / getattr(fit.measured, sensor))
        for sensor in ("vertical_acceleration", "pitch_rate")
    ]
    turned = np.angle(np.exp(1j * (fit.modelled.phase_rad - fit.measured.phase_rad)))
    return np.array(logs), turned[fit.modelled.coherence > 0.8]


def test_the_fitted_half_car_agrees_with_the_measured_spectra() -> None:
    """Drives of a half-car: the one fitted to them explains their spectra, phase and coherence."""
    runs = [run_of(0.0, 52.0, 1), run_of(300.0, 47.0, 2)]
    taught = teach(runs, VAN)
    fits = fits_of(runs, taught.model, taught.loads)
    assert [fit.run.number for fit in fits] == [1, 2]
    for fit in fits:
        logs, turned = differences(fit)
        assert np.median(np.abs(turned)) < 0.02
        assert np.median(np.abs(logs)) < 0.1


@pytest.fixture(scope="module")
def calibration() -> VehicleModel:
    return as_if_fitted(CAR, np.zeros(len(CAR)))


def test_the_model_lies_over_the_spectra_of_the_same_vehicle(calibration: VehicleModel) -> None:
    (fit,) = fits_of([run_of(270.0, 47.0, noise=0.0)], calibration, ())
    logs, turned = differences(fit)
    assert np.sqrt(np.mean(logs**2)) < 0.1  # some eighty half-overlapping segments scatter by about 8 %
    assert len(turned) > 20
    assert np.abs(turned).max() < 0.2
    assert np.abs(fit.modelled.coherence - fit.measured.coherence).mean() < 0.08


def found_of(load: Load, **deviations: float) -> tuple[FoundLoad]:
    """What a fit found of the first drive: its load, and deviations of the vehicle by the parameter's name."""
    own = np.zeros(N_OWN)
    for name, by in deviations.items():
        own[OWN.index(INDEX[name])] = by
    return (FoundLoad(drive_name(1), load, own, 0.0, np.nan, np.nan, is_held=False),)


def test_a_run_is_drawn_with_the_goods_that_were_found(calibration: VehicleModel) -> None:
    """Its payload swings at 14 Hz on its pallets, unlike the vehicle's usual one."""
    car, load = CAR.copy(), Load(270.0, 47.0)
    car[INDEX["payload_mode_hz"]] = np.log(14.0)
    ringing = run_of(270.0, 47.0, noise=0.0, car=car)
    by = np.log(14.0) - CAR[INDEX["payload_mode_hz"]]
    (as_found,) = fits_of([ringing], calibration, found_of(load, payload_mode_hz=by))
    (as_usual,) = fits_of([ringing], calibration, found_of(load))
    assert np.mean(differences(as_usual)[0] ** 2) > 1.2 * np.mean(differences(as_found)[0] ** 2)
    assert as_usual.misfit > as_found.misfit


def test_a_load_that_was_found_takes_the_place_of_the_stated_one(calibration: VehicleModel) -> None:
    said_wrong = replace(run_of(270.0, 47.0, noise=0.0), payload_kg=100.0)
    (as_said,) = fits_of([said_wrong], calibration, ())
    (as_found,) = fits_of([said_wrong], calibration, found_of(Load(270.0, 47.0)))
    assert as_found.misfit < as_said.misfit
    assert as_found.load == Load(270.0, 47.0)


@pytest.mark.parametrize("gain", [0.1, 7.0])
def test_a_rougher_road_lifts_model_and_measurement_alike(calibration: VehicleModel, gain: float) -> None:
    run = run_of(270.0, 47.0)
    (batch,) = run.batches
    louder = replace(
        batch,
        vertical_acceleration_mps2=gain * batch.vertical_acceleration_mps2,
        pitch_rate_radps=gain * batch.pitch_rate_radps,
    )
    one, other = (fits_of([replace(run, batches=(each,))], calibration, ())[0] for each in (batch, louder))
    np.testing.assert_allclose(other.measured.pitch_rate, gain * one.measured.pitch_rate, rtol=0.03)
    np.testing.assert_allclose(other.measured.coherence, one.measured.coherence, atol=0.03)
    assert np.mean(differences(other)[0]) == pytest.approx(0.0, abs=0.02)


WIDE = replace(VAN, track_width_m=1.5, sensor_offset_left_m=0.3)
ROLL_MEAN, ROLL_STD = prior_of(ROWS, WIDE)


def test_the_report_has_the_roll_of_the_drives() -> None:
    std = ROLL_STD.copy()
    std[-1] *= 0.25
    known = knowledge_of(as_if_fitted(ROLL_MEAN, std, WIDE), WIDE)
    assert [one.name for one in known] == list(NAMES)
    assert known[-1].name == "empty_left_m"
    assert known[-1].left_over == pytest.approx(0.25)
    assert all(one.left_over == pytest.approx(1.0) for one in known[:-1])
    assert "roll_inertia_kgm2" in told(known)
    assert "empty_left_m" not in told(known)
    rows = {row[0]: row for row in knowledge_table(known).rows}
    assert set(rows) == {name for name in NAMES if not name.startswith("slack_")}
    before = float(rows["roll_inertia_kgm2"][1])
    assert before == pytest.approx(1240.0 * (0.42 * 1.5) ** 2, rel=1e-3)  # in its unit, not its logarithm


def judged(cg_left: CgLeftErrors | None, wheels: WheelErrors | None) -> Judgement:
    """One set without a weight."""
    none = TargetErrors("kg", None, None, None, None, None, None, None, None, None, None)
    errors = Errors(0, 0, {}, none, replace(none, unit="pp"), cg_left, wheels)
    return Judgement("cross_spectrum", {BatchSet.VALIDATION: ErrorTable("cross_spectrum", (), errors, ())})


def test_the_table_of_errors_has_the_lateral_ones_where_they_are_known() -> None:
    found = CgLeftErrors(mean_abs_m=0.0123, bias_m=0.0, std_m=0.02, max_abs_m=0.03, coverage95=0.9)
    rows = {row[1]: row for row in summary_table(judged(found, WheelErrors(1.26, 2.0))).rows}
    assert {"12.30 mm", "90 %"} <= {*rows["centre of gravity, left"]}
    assert "1.26" in rows["each wheel's load"]
    assert set(rows) - {row[1] for row in summary_table(judged(found, None)).rows} == {"each wheel's load"}
