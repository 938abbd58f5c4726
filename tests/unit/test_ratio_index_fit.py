"""Bands and regression found on made-up drives whose resonances fall with the load."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from gateway.calibration.ratio_index_fit import RatioIndexFit, fit_ratio_index
from gateway.core.known_run import KnownRun
from gateway.core.ratio_index import indexes_of
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64, Batch, Why

VAN = Vehicle("van", empty_mass_kg=1240.0, wheelbase_m=2.8)
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
    return Batch(
        t_start_ns=0,
        t_end_ns=N * 20_000_000,
        drive_start_ns=0,
        rate_hz=50.0,
        vertical_acceleration_mps2=resonance(bounce_hz, rng),
        pitch_rate_radps=0.05 * resonance(pitch_hz, rng),
        speed_mps=15.0 + 0.2 * rng.standard_normal(N),
        usable=np.ones(N, bool),
        gravity_mps2=9.81,
        gap_share=0.0,
        shares={},
    )


def runs_of(loads: list[tuple[float, float]]) -> list[KnownRun]:
    return [
        KnownRun(i, f"{i}.log", kg, pct, (batch_of(kg, pct, 10 * i), batch_of(kg, pct, 10 * i + 1)))
        for i, (kg, pct) in enumerate(loads, 1)
    ]


RUNS = runs_of(LOADS)


@pytest.fixture(scope="module")
def fit() -> RatioIndexFit:
    return fit_ratio_index(RUNS, VAN)


def test_unseen_loads_are_told_within_the_stated_spread(fit: RatioIndexFit) -> None:
    assert (fit.n_runs, fit.n_batches) == (7, 14)
    model, shares = fit.calibration.payload, fit.calibration.front_share
    assert model is not None
    assert shares is not None
    assert model.residual_std < 60.0  # the loads themselves spread by 160 kg
    n_covered = 0
    for i, (kg, pct) in enumerate([(50.0, 51.5), (225.0, 48.0), (320.0, 50.0), (425.0, 51.0)]):
        indexes = indexes_of(batch_of(kg, pct, 1000 + i), fit.calibration)
        found_kg, std_kg, (low_kg, high_kg) = model.predict(*indexes)
        found_pct, std_pct, _ = shares.predict(*indexes)
        n_covered += low_kg <= kg <= high_kg
        assert abs(found_kg - kg) < 3.5 * std_kg
        assert abs(found_pct - pct) < 3.5 * std_pct
    assert n_covered >= 3


def test_the_order_of_runs_and_rejected_batches_do_not_matter(fit: RatioIndexFit) -> None:
    spoiled = replace(RUNS[0].batches[0], rejected=(Why.TOO_SLOW,), vertical_acceleration_mps2=np.full(N, 1e3))
    more = [replace(RUNS[0], batches=(*RUNS[0].batches, spoiled)), *RUNS[1:]]
    one, other = fit.calibration, fit_ratio_index(more[::-1], VAN).calibration
    assert other.acceleration_bands == one.acceleration_bands
    assert other.pitch_rate_bands == one.pitch_rate_bands
    assert one.payload is not None
    assert other.payload is not None
    assert other.payload.predict(1.0, 1.0)[:2] == pytest.approx(one.payload.predict(1.0, 1.0)[:2], rel=1e-6)


def test_without_pitch_rate_the_payload_alone_is_told() -> None:
    silent = [
        replace(run, batches=tuple(replace(b, pitch_rate_radps=np.full(N, np.nan)) for b in run.batches))
        for run in RUNS
    ]
    calibration = fit_ratio_index(silent, VAN).calibration
    assert calibration.payload is not None
    assert calibration.payload.terms == ("cbrt_ra",)
    assert (calibration.front_share, calibration.pitch_rate_bands) == (None, None)


def test_what_cannot_carry_a_calibration_is_refused() -> None:
    with pytest.raises(CalibrationImpossibleError, match="different payloads"):
        fit_ratio_index(runs_of([(90.0, 50.0)] * 4), VAN)
    with pytest.raises(CalibrationImpossibleError, match="at least three runs"):
        fit_ratio_index(RUNS[:2], VAN)
    with pytest.raises(CalibrationImpossibleError, match="unbroken driving"):
        fit_ratio_index([replace(run, batches=()) for run in RUNS], VAN)
