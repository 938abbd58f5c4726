"""Bands and regression found on made-up campaigns whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy import signal
from support import half_car_road
from support.paper_van import paper_van

from gateway.calibration.ratio_index.bands import candidate_pairs
from gateway.calibration.ratio_index.index_fit import RatioIndexFit, fit_ratio_index
from gateway.calibration.ratio_index.spectra_table import SpectrumTable
from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.core.ratio_index.index import PAPER_BANDS, RatioIndexCalibration, indexes_of
from gateway.core.ratio_index.regression import MODEL_9_PAYLOAD, MODEL_11_FRONT_SHARE, MODEL_11_PAYLOAD
from gateway.errors import CalibrationImpossibleError
from gateway.estimates.batch_estimate import UNKNOWN
from gateway.records import F64, Batch, Why
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.weighing.estimator import estimate

VAN = paper_van()
N = 12_000
LOADS = [(0.0, 50.0), (90.0, 51.0), (180.0, 46.0), (270.0, 53.0), (360.0, 47.0), (450.0, 52.0), (400.0, 49.0)]


def resonance(freq_hz: float, rng: np.random.Generator) -> F64:
    """White noise through a second-order resonance, damping ratio 0.25, and a little noise of its own."""
    w = 2.0 * np.pi * freq_hz
    b, a = signal.bilinear([w**2], [1.0, 0.5 * w, w**2], fs=50.0)
    return np.asarray(signal.lfilter(b, a, rng.standard_normal(N)) + 0.1 * rng.standard_normal(N))


def batch_of(payload_kg: float, front_share_pct: float, seed: int) -> Batch:
    rng = np.random.default_rng(seed)
    bounce_hz = 2.6 / np.sqrt(1.0 + payload_kg / VAN.empty_mass_kg)
    pitch_hz = 2.0 + 0.08 * (front_share_pct - 50.0)
    acceleration_mps2, pitch_rate_radps = resonance(bounce_hz, rng), 0.05 * resonance(pitch_hz, rng)
    return half_car_road.batch_of(acceleration_mps2, pitch_rate_radps, speed_mps=15.0 + 0.2 * rng.standard_normal(N))


def runs_of(loads: list[tuple[float, float]]) -> list[StatedDrive]:
    return [
        known_drive(i, f"{i}.log", kg, pct, (batch_of(kg, pct, 10 * i), batch_of(kg, pct, 10 * i + 1)))
        for i, (kg, pct) in enumerate(loads, 1)
    ]


RUNS = runs_of(LOADS)


@pytest.fixture(scope="module")
def fit() -> RatioIndexFit:
    return fit_ratio_index(RUNS, VAN)


def test_unseen_loads_are_estimated_within_the_stated_spread(fit: RatioIndexFit) -> None:
    assert (fit.table.n_runs, len(fit.table.run)) == (7, 14)
    model, shares = fit.calibration.payload, fit.calibration.front_share
    assert model.residual_std < 90.0  # the loads themselves spread by 160 kg
    n_covered = 0
    for i, (kg, pct) in enumerate([(50.0, 51.5), (225.0, 48.0), (320.0, 50.0), (425.0, 51.0)]):
        indexes = indexes_of(batch_of(kg, pct, 1000 + i), fit.calibration)
        found_kg, std_kg, (low_kg, high_kg) = model.predict(*indexes)
        found_pct, std_pct, _ = shares.predict(*indexes)
        n_covered += low_kg <= kg <= high_kg
        assert abs(found_kg - kg) < 3.5 * std_kg
        assert abs(found_pct - pct) < 3.5 * std_pct
    assert n_covered >= 3


def calibrated(calibration: RatioIndexCalibration) -> CalibratedVehicle:
    return CalibratedVehicle("van", VAN, (0.0, 450.0), (46.0, 53.0), ratio_index=calibration)


def test_white_noise_has_no_weight_however_wide_its_interval(fit: RatioIndexFit) -> None:
    rng = np.random.default_rng(4)
    noise = replace(
        batch_of(0.0, 50.0, 1),
        vertical_acceleration_mps2=rng.standard_normal(N),
        pitch_rate_radps=rng.standard_normal(N),
    )
    found = estimate(noise, calibrated(fit.calibration), "ratio_index")
    assert (found.rejected, found.payload) == ((Why.OUT_OF_RANGE,), UNKNOWN)
    assert np.isfinite(found.ratio_index_acceleration)


def test_an_answer_too_wide_to_be_of_use_is_refused_as_the_other_estimator_does(fit: RatioIndexFit) -> None:
    model = fit.calibration.payload
    assert model is not None
    vague = replace(fit.calibration, payload=replace(model, residual_std=0.16 * VAN.empty_mass_kg))
    batch = batch_of(225.0, 48.0, 1001)
    assert estimate(batch, calibrated(fit.calibration), "ratio_index").counted
    found = estimate(batch, calibrated(vague), "ratio_index")
    assert (found.rejected, found.payload) == ((Why.TOO_UNCERTAIN,), UNKNOWN)


def test_the_order_of_runs_and_rejected_batches_change_no_bit(fit: RatioIndexFit) -> None:
    spoiled = replace(RUNS[0].batches[0], rejected=(Why.TOO_SLOW,), vertical_acceleration_mps2=np.full(N, 1e3))
    more = [replace(RUNS[0], batches=(*RUNS[0].batches, spoiled)), *RUNS[1:]]
    renumbered = [replace(run, number=i) for i, run in enumerate(more[::-1], 1)]
    other = fit_ratio_index(renumbered, VAN)
    one_file, other_file = (TypeAdapter(RatioIndexCalibration).dump_json(found.calibration) for found in (fit, other))
    assert other_file == one_file
    assert fit.payload_errors_kg is not None
    np.testing.assert_array_equal(other.payload_errors_kg, fit.payload_errors_kg)


def test_without_pitch_rate_only_the_payload_is_estimated() -> None:
    silent = [
        replace(run, batches=tuple(replace(b, pitch_rate_radps=np.full(N, np.nan)) for b in run.batches))
        for run in RUNS
    ]
    calibration = fit_ratio_index(silent, VAN).calibration
    assert calibration.payload.terms == MODEL_9_PAYLOAD
    assert (calibration.front_share, calibration.pitch_rate_bands) == (None, None)


def test_the_papers_bands_come_with_its_joint_structure() -> None:
    fit = fit_ratio_index(RUNS, VAN, bands="table2")
    assert fit.calibration.acceleration_bands == PAPER_BANDS["acceleration"]
    assert fit.calibration.pitch_rate_bands == PAPER_BANDS["pitch_rate"]
    models = fit.calibration.payload, fit.calibration.front_share
    assert tuple(model.terms for model in models if model) == (MODEL_11_PAYLOAD, MODEL_11_FRONT_SHARE)


def test_nested_errors_of_a_run_come_from_a_choice_made_without_it(fit: RatioIndexFit) -> None:
    """The same by hand: calibrate on six runs, estimate the seventh."""
    out = RUNS[2]
    without = fit_ratio_index([run for run in RUNS if run is not out], VAN).calibration
    found = [without.payload.predict(*indexes_of(batch, without))[0] - out.payload_kg for batch in out.batches]
    is_of_run = fit.table.number == out.number
    np.testing.assert_allclose(fit.payload_errors_kg[is_of_run], found, rtol=1e-9, atol=1e-7)


def test_too_few_runs_for_nesting_still_calibrate() -> None:
    fit = fit_ratio_index(RUNS[:3], VAN)
    assert fit.calibration.payload.terms == MODEL_9_PAYLOAD
    assert fit.payload_errors_kg is not None
    assert np.all(np.isfinite(fit.payload_errors_kg))
    assert fit.front_share_errors_pct is None


def test_data_that_cannot_be_fitted_are_refused() -> None:
    with pytest.raises(CalibrationImpossibleError, match="different payloads"):
        fit_ratio_index(runs_of([(90.0, 50.0)] * 4), VAN)
    with pytest.raises(CalibrationImpossibleError, match="at least three runs"):
        fit_ratio_index(RUNS[:2], VAN)
    with pytest.raises(CalibrationImpossibleError, match="unbroken driving"):
        fit_ratio_index([replace(run, batches=()) for run in RUNS], VAN)


FREQ_HZ = np.arange(1, 205) * (50.0 / 1024)
LOADS_KG = np.array([0.0, 100.0, 200.0, 300.0, 400.0, 250.0])
SHARES_PCT = np.array([50.0, 45.0, 56.0, 41.0, 52.0, 48.0])


def line(centre_hz: float) -> F64:
    return np.exp(-0.5 * ((FREQ_HZ - centre_hz) / 0.2) ** 2)


def table_of(roughness: F64) -> SpectrumTable:
    """Load lifts the acceleration at 2 Hz and lowers it at 4; share lifts the pitch rate at 3 Hz and lowers it at 6."""
    run = np.arange(len(LOADS_KG))
    by_load, by_share = LOADS_KG[:, None] / 400.0, (SHARES_PCT[:, None] - 50.0) / 20.0
    return SpectrumTable(
        run=run,
        number=run + 1,
        targets=(LOADS_KG, SHARES_PCT),
        freq_hz=FREQ_HZ,
        spectra=(
            roughness[:, None] * (1.0 + 0.8 * by_load * line(2.0) - 0.5 * by_load * line(4.0)),
            0.1 * roughness[:, None] * (1.0 + by_share * line(3.0) - by_share * line(6.0)),
        ),
        n_segments=np.full(len(run), 28.0),
    )


def test_bands_are_chosen_where_the_load_shows_on_any_road() -> None:
    table = table_of(np.array([1.0, 3.0, 0.5, 2.0, 4.0, 1.5]))
    for sensor, over_hz, under_hz in ((0, 2.0, 4.0), (1, 3.0, 6.0)):
        best = candidate_pairs(table, sensor, 0.5, 5)[0]
        over, under = best.bands
        assert (over.centre_hz, under.centre_hz) == pytest.approx((over_hz, under_hz), abs=1.3)
        assert best.monotonicity > 0.9
