"""Calibrates the ratio index: bands found on the campaign, then the static regression (9), (10), (11)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gateway.calibration.bands import WIDTHS_HZ, BandPair, IndexTable, band_amplitudes, candidate_pairs
from gateway.core.known_run import KnownRun
from gateway.core.ratio_index import Band, RatioIndexCalibration, SpectrumKind, mean_spectrum
from gateway.core.regression import (
    MODEL_9_PAYLOAD,
    MODEL_10_FRONT_SHARE,
    MODEL_11_FRONT_SHARE,
    MODEL_11_PAYLOAD,
    RegressionModel,
    scaled_columns,
    term_columns,
)
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64, I64, Batch

N_SEGMENT = 1024  # 20.5 s at 50 Hz: resolves 0.05 Hz and still fits between two traffic lights
N_CANDIDATES = 12
SPEED_STD_FACTOR = 2.0  # a batch's speed may spread this many times as much as the widest calibrated


@dataclass(frozen=True, slots=True)
class RatioIndexFit:
    """The calibration and what stands behind it: leave-one-run-out errors in kg and percentage points."""

    calibration: RatioIndexCalibration
    payload_errors_kg: F64 | None
    front_share_errors_pct: F64 | None
    n_runs: int
    n_batches: int


def fit_ratio_index(runs: Sequence[KnownRun], vehicle: Vehicle, kind: SpectrumKind = "amplitude") -> RatioIndexFit:
    """Identification runs -> calibration. Raises CalibrationImpossibleError where they cannot carry one."""
    batches = [(run, batch) for run in runs for batch in run.batches if not batch.rejected]
    table = _table(batches, kind)
    structures = _structures(table)
    chosen = min(
        (_evaluate(pair_a, pair_g, table, structures, vehicle) for pair_a, pair_g in _candidates(table)),
        key=lambda trial: trial.score,
        default=None,
    )
    if chosen is None or not np.isfinite(chosen.score):
        raise CalibrationImpossibleError(
            "no pair of bands follows the load over these runs: drive more different loads"
        )
    speeds = [batch.mean_speed_mps for _, batch in batches]
    calibration = RatioIndexCalibration(
        spectrum=kind,
        n_segment=N_SEGMENT,
        acceleration_bands=chosen.acceleration_bands,
        pitch_rate_bands=chosen.pitch_rate_bands,
        payload=chosen.payload.model if chosen.payload else None,
        front_share=chosen.front_share.model if chosen.front_share else None,
        speed_range_mps=(min(speeds), max(speeds)),
        speed_std_max_mps=SPEED_STD_FACTOR * max(_speed_std_mps(batch) for _, batch in batches),
    )
    return RatioIndexFit(
        calibration,
        chosen.payload.held_out_errors if chosen.payload else None,
        chosen.front_share.held_out_errors if chosen.front_share else None,
        n_runs=len(np.unique(table.run)),
        n_batches=len(table.run),
    )


@dataclass(frozen=True, slots=True)
class Fitted:
    """A regression and its errors (n,) on runs left out."""

    model: RegressionModel
    held_out_errors: F64


@dataclass(frozen=True, slots=True)
class _Trial:
    acceleration_bands: tuple[Band, Band] | None
    pitch_rate_bands: tuple[Band, Band] | None
    payload: Fitted | None
    front_share: Fitted | None
    score: float


@dataclass(frozen=True, slots=True)
class _Structures:
    payload: tuple[str, ...] | None
    front_share: tuple[str, ...] | None


def _speed_std_mps(batch: Batch) -> float:
    return float(np.std(batch.speed_mps[batch.usable]))


def _table(batches: list[tuple[KnownRun, Batch]], kind: SpectrumKind) -> IndexTable:
    """Spectra of every batch of which both mapped sensors give one."""
    rows = [(run, *_spectra(batch, kind)) for run, batch in batches]
    has_a = any(a is not None for _, a, _ in rows)
    has_g = any(g is not None for _, _, g in rows)
    whole = [(run, a, g) for run, a, g in rows if (a is not None or not has_a) and (g is not None or not has_g)]
    if not whole or not (has_a or has_g):
        raise CalibrationImpossibleError("no identification batch has enough unbroken driving for a spectrum")
    freq_hz = next(spectrum[0] for _, a, g in whole for spectrum in (a, g) if spectrum is not None)
    return IndexTable(
        run=np.array([run.number for run, _, _ in whole]),
        payload_kg=np.array([run.payload_kg for run, _, _ in whole]),
        front_share_pct=np.array([run.front_share_pct for run, _, _ in whole]),
        freq_hz=freq_hz,
        acceleration=np.array([a[1] for _, a, _ in whole if a is not None]) if has_a else None,
        pitch_rate=np.array([g[1] for _, _, g in whole if g is not None]) if has_g else None,
        kind=kind,
    )


def _spectra(batch: Batch, kind: SpectrumKind) -> tuple[tuple[F64, F64] | None, tuple[F64, F64] | None]:
    a, g = (
        mean_spectrum(x, batch.usable, N_SEGMENT, batch.rate_hz, kind)
        for x in (batch.vertical_acceleration_mps2, batch.pitch_rate_radps)
    )
    return a, g


def _structures(table: IndexTable) -> _Structures:
    """(11) where both sensors and enough different runs are there, (9) and (10) where not.

    Raises CalibrationImpossibleError where not even those could be told from chance.
    """
    n_runs = len(np.unique(table.run))
    n_loads, n_shares = len(np.unique(table.payload_kg)), len(np.unique(table.front_share_pct.round(2)))
    if n_loads < 2:
        raise CalibrationImpossibleError(
            "the ratio index needs runs with at least two different payloads; all of these carry "
            f"{table.payload_kg[0]:g} kg: drive the vehicle empty and loaded"
        )
    both = table.acceleration is not None and table.pitch_rate is not None
    if both and n_runs >= len(MODEL_11_PAYLOAD) + 2 and n_shares >= 3:
        return _Structures(MODEL_11_PAYLOAD, MODEL_11_FRONT_SHARE)
    payload = MODEL_9_PAYLOAD if table.acceleration is not None and n_runs >= 3 else None
    front_share = MODEL_10_FRONT_SHARE if table.pitch_rate is not None and n_runs >= 4 and n_shares >= 3 else None
    if payload is None and front_share is None:
        raise CalibrationImpossibleError(
            f"the ratio index needs at least three runs, there are {n_runs}: drive another known load"
        )
    return _Structures(payload, front_share)


def _candidates(table: IndexTable) -> list[tuple[BandPair | None, BandPair | None]]:
    """Pairs of band pairs worth a regression: the most significant of each width."""
    found: list[tuple[BandPair | None, BandPair | None]] = []
    for width_hz in WIDTHS_HZ:
        of_a = _pairs_of(table, table.acceleration, table.payload_kg, table.front_share_pct, width_hz)
        of_g = _pairs_of(table, table.pitch_rate, table.front_share_pct, table.payload_kg, width_hz)
        found.extend((a, g) for a in of_a for g in of_g)
    return found


def _pairs_of(
    table: IndexTable, spectra: F64 | None, target: F64, other: F64, width_hz: float
) -> list[BandPair | None]:
    if spectra is None:
        return [None]
    return [*candidate_pairs(table, spectra, target, other, width_hz, N_CANDIDATES)]


def _evaluate(
    pair_a: BandPair | None, pair_g: BandPair | None, table: IndexTable, structures: _Structures, vehicle: Vehicle
) -> _Trial:
    """Regressions with these bands, scored by their errors on runs left out, as shares of the ranges (12)."""
    ra, rg = _ratios(pair_a, table.acceleration, table), _ratios(pair_g, table.pitch_rate, table)
    payload = _fit(structures.payload, ra, rg, table.payload_kg, table.run)
    front_share = _fit(structures.front_share, ra, rg, table.front_share_pct, table.run)
    score = 0.0
    for fitted, (low, high) in (
        (payload, vehicle.payload_range_kg),
        (front_share, vehicle.front_share_range_pct),
    ):
        score += float(np.mean((fitted.held_out_errors / (high - low)) ** 2)) if fitted else 0.0
    return _Trial(pair_a.bands if pair_a else None, pair_g.bands if pair_g else None, payload, front_share, score)


def _ratios(pair: BandPair | None, spectra: F64 | None, table: IndexTable) -> F64:
    if pair is None or spectra is None:
        return np.full(len(table.run), np.nan)
    passed = band_amplitudes(table.freq_hz, spectra, list(pair.bands), table.kind)
    return np.asarray(passed[:, 0] / passed[:, 1])


def _fit(terms: tuple[str, ...] | None, ra: F64, rg: F64, target: F64, run: I64) -> Fitted | None:
    return None if terms is None else fit_regression(terms, ra, rg, target, run)


def fit_regression(terms: tuple[str, ...], ra: F64, rg: F64, target: F64, run: I64) -> Fitted:
    """Least squares over batches, with its spread from whole runs left out.

    Batches of one run share road and load and so are not independent: the residual spread is the root
    mean square over runs held out, less what the held-out rows' own leverage adds, and its degrees of
    freedom are the runs' less one.
    """
    raw = term_columns(terms, ra, rg)
    lows, highs = raw.min(axis=0), raw.max(axis=0)
    columns = scaled_columns(terms, ra, rg, lows, highs)
    gram_inverse: F64 = np.linalg.pinv(columns.T @ columns).astype(float)
    errors, leverage = _held_out(columns, target, run)
    model = RegressionModel(
        terms=terms,
        lows=lows,
        highs=highs,
        coefficients=gram_inverse @ columns.T @ target,
        gram_inverse=gram_inverse,
        residual_std=float(np.sqrt(np.mean(errors**2) / (1.0 + np.mean(leverage)))),
        dof=float(len(np.unique(run)) - 1),
    )
    return Fitted(model, errors)


def _held_out(columns: F64, target: F64, run: I64) -> tuple[F64, F64]:
    """Error (n,) of each batch when its whole run is left out of the fit, and its leverage there (n,)."""
    errors, leverage = np.empty(len(target)), np.empty(len(target))
    for number in np.unique(run):
        out = run == number
        inverse = np.linalg.pinv(columns[~out].T @ columns[~out])
        errors[out] = columns[out] @ (inverse @ columns[~out].T @ target[~out]) - target[out]
        leverage[out] = np.einsum("ij,jk,ik->i", columns[out], inverse, columns[out])
    return errors, leverage
