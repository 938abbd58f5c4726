"""The one interface of every estimator, (Batch, CalibratedVehicle) -> Estimate, and the list of them."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Protocol

import numpy as np

from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum.estimator import CrossSpectrum
from gateway.core.ratio_index.index import indexes_of
from gateway.core.spectrum import roughness_mps2, spectra_of
from gateway.records import Batch, Estimate, Why

SPEED_MARGIN = 0.15  # how far a batch's mean speed may lie outside those calibrated, as a share


class Estimator(Protocol):
    """Turns a batch that passed the common gates into numbers, or into reasons of its own."""

    def __call__(self, batch: Batch, calibrated: CalibratedVehicle, blank: Estimate) -> Estimate:
        """Return ``blank`` with numbers filled in, or with ``rejected`` set."""
        ...


def estimate(batch: Batch, calibrated: CalibratedVehicle | None, estimator: str) -> Estimate:
    """What ``batch`` tells by the named estimator: numbers, or why not. Never raises on a batch."""
    spectra = spectra_of(batch)
    blank = Estimate(
        t_start_ns=batch.t_start_ns,
        t_end_ns=batch.t_end_ns,
        estimator=estimator,
        calibration_id=calibrated.id if calibrated else None,
        mean_speed_mps=batch.mean_speed_mps,
        gap_share=batch.gap_share,
        usable_share=batch.usable_share,
        roughness_mps2=roughness_mps2(spectra, batch.mean_speed_mps),
        shares={str(why): share for why, share in batch.shares.items()},
        rejected=batch.rejected,
        is_provisional=batch.is_provisional,
        spectra=spectra,
    )
    if calibrated is None:
        return replace(blank, rejected=(*batch.rejected, Why.NO_CALIBRATION))
    if batch.rejected:
        return blank
    found = ESTIMATORS[estimator](batch, calibrated, blank)
    if found.counted and calibrated.is_out_of_range(found.payload_interval95_kg, found.front_share_interval95_pct):
        return _without_numbers(found, Why.OUT_OF_RANGE)
    return found


def _without_numbers(found: Estimate, why: Why) -> Estimate:
    nothing = (np.nan, np.nan)
    return replace(
        found,
        payload_kg=np.nan,
        payload_std_kg=np.nan,
        payload_interval95_kg=nothing,
        front_share_pct=np.nan,
        front_share_std_pct=np.nan,
        front_share_interval95_pct=nothing,
        rejected=(why,),
    )


def by_ratio_index(batch: Batch, calibrated: CalibratedVehicle, blank: Estimate) -> Estimate:
    """The paper's estimator: R_a and R_g by (7), (8), then the static regression (9), (10) or (11).

    Its gates are narrow, because the index moves with speed: the speed's spread within the batch and
    its distance from the calibrated speeds are bounded.
    """
    calibration = calibrated.ratio_index
    if calibration is None:
        return replace(blank, rejected=(Why.NO_CALIBRATION,))
    if float(np.std(batch.speed_mps[batch.usable])) > calibration.speed_std_max_mps:
        return replace(blank, rejected=(Why.SPEED_SPREAD,))
    slowest, fastest = calibration.speed_range_mps
    if not slowest * (1.0 - SPEED_MARGIN) <= batch.mean_speed_mps <= fastest * (1.0 + SPEED_MARGIN):
        return replace(blank, rejected=(Why.SPEED_UNCALIBRATED,))
    ra, rg = indexes_of(batch, calibration)
    found = replace(blank, ratio_index_acceleration=ra, ratio_index_pitch_rate=rg)
    wanted = [ra] * (calibration.acceleration_bands is not None) + [rg] * (calibration.pitch_rate_bands is not None)
    if not all(np.isfinite(wanted)):
        return replace(found, rejected=(Why.NOT_ENOUGH_EXCITATION,))
    if calibration.payload is not None:
        centre, std, interval = calibration.payload.predict(ra, rg)
        found = replace(found, payload_kg=centre, payload_std_kg=std, payload_interval95_kg=interval)
    if calibration.front_share is not None:
        centre, std, interval = calibration.front_share.predict(ra, rg)
        found = replace(found, front_share_pct=centre, front_share_std_pct=std, front_share_interval95_pct=interval)
    return found


def by_cross_spectrum(batch: Batch, calibrated: CalibratedVehicle, blank: Estimate) -> Estimate:
    """The half-car held against both sensors' cross-spectra; see core.cross_spectrum.

    The ratio indexes are shown beside it where the file holds their bands.
    """
    if calibrated.cross_spectrum is None:
        return replace(blank, rejected=(Why.NO_CALIBRATION,))
    found = CrossSpectrum().estimate(batch, calibrated.cross_spectrum)
    ra, rg = indexes_of(batch, calibrated.ratio_index) if calibrated.ratio_index else (np.nan, np.nan)
    return replace(
        blank,
        payload_kg=found.payload_kg,
        payload_std_kg=found.payload_std_kg,
        payload_interval95_kg=found.payload_interval95_kg,
        front_share_pct=found.front_share_pct,
        front_share_std_pct=found.front_share_std_pct,
        front_share_interval95_pct=found.front_share_interval95_pct,
        ratio_index_acceleration=ra,
        ratio_index_pitch_rate=rg,
        rejected=found.rejected,
        diagnostics=found.diagnostics,
    )


ESTIMATORS: Mapping[str, Estimator] = MappingProxyType(
    {"cross_spectrum": by_cross_spectrum, "ratio_index": by_ratio_index}  # the better first
)
