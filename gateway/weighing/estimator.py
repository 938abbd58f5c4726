"""The common interface of the estimators, their table, and their common gates."""

import math
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Final, Protocol

import numpy as np

from gateway.core.ratio_index.index import indexes_of
from gateway.core.ratio_index.paper_estimator import by_ratio_index
from gateway.core.spectrum import roughness_mps2, spectra_of
from gateway.core.vehicle import Vehicle
from gateway.estimates.batch_estimate import Estimate
from gateway.estimates.posterior import FRONT_SHARE, Posterior, Source
from gateway.model.checks import MOST_PAYLOAD_STD_SHARE
from gateway.model.weigh import by_cross_spectrum
from gateway.records import Batch, Why
from gateway.weighing.calibrated import BY_MODEL, CalibratedVehicle


class Estimator(Protocol):
    """Turns a batch that passed the common gates into numbers, or into reasons."""

    def __call__(self, batch: Batch, calibrated: CalibratedVehicle, blank: Estimate) -> Estimate:
        """Return ``blank`` with numbers filled in, or with ``rejected`` set."""
        ...


BROKEN_DOWN: Final = (ArithmeticError, ValueError)
"""The numerical errors of numpy.linalg (LinAlgError is a ValueError), math and scipy.linalg."""


def estimate(batch: Batch, calibrated: CalibratedVehicle | None, estimator: str) -> Estimate:
    """The estimate of ``batch`` by the named estimator: numbers, or reasons for a refusal.

    Never raises on a batch, whatever its samples. If the computation breaks down or its result is not finite, the batch
    is refused with NO_SOLUTION. Raises KeyError for an unknown estimator.
    """
    with np.errstate(all="ignore"):  # overflows show up as non-finite results below
        blank = _blank(batch, calibrated, estimator)
        if calibrated is None or batch.rejected:
            return blank
        if calibrated.is_sampled_otherwise(batch.sensor_rate_hz):
            return replace(blank, rejected=(Why.SAMPLE_RATE,))
        weigh = ESTIMATORS[estimator]
        try:
            found = weigh(batch, calibrated, blank)
            if not found.counted:
                return found
            if calibrated.is_out_of_range(estimator, found.payload.interval95, found.front_share.interval95):
                return found.refused(Why.OUT_OF_RANGE)  # without the stated share's error, which known loads share
            answer = _as_stated(found, calibrated.vehicle)
            return answer if _is_sound(answer.posterior) else answer.refused(Why.NO_SOLUTION)
        except BROKEN_DOWN:
            return blank.refused(Why.NO_SOLUTION)


def _is_sound(posterior: Posterior | None) -> bool:
    """Whether the posterior is finite and its own covariance is positive definite; True for None."""
    if posterior is None:
        return True
    parts = (posterior.mean, posterior.own, np.array([posterior.tails, posterior.leans]), *posterior.sources.values())
    return all(np.isfinite(part).all() for part in parts) and bool(np.all(np.linalg.eigvalsh(posterior.own) > 0.0))


def _blank(batch: Batch, calibrated: CalibratedVehicle | None, estimator: str) -> Estimate:
    """The estimate without an answer: the fields that describe the batch."""
    spectra = spectra_of(batch)
    return Estimate(
        t_start_ns=batch.t_start_ns,
        t_end_ns=batch.t_end_ns,
        estimator=estimator,
        calibration_id=calibrated.id if calibrated else None,
        mean_speed_mps=batch.mean_speed_mps,
        gap_share=batch.gap_share,
        usable_share=batch.usable_share,
        roll_usable_share=_roll_usable_share(batch),
        roughness_mps2=roughness_mps2(spectra, batch.mean_speed_mps),
        shares={str(why): share for why, share in batch.shares.items()},
        rejected=batch.rejected if calibrated else (*batch.rejected, Why.NO_CALIBRATION),
        is_provisional=batch.is_provisional,
        spectra=spectra,
    )


def _as_stated(found: Estimate, vehicle: Vehicle) -> Estimate:
    """``found`` with the error of the empty vehicle's stated front share as a source.

    Known loads are placed by the stated share s, and the half-car they calibrate absorbs its error: refitted with
    another s it gives the same payloads, and front shares D that follow from statics, D (M + L) = s M + the part of L
    on the front axle. So dD / ds = M / (M + L).
    """
    if found.posterior is None or found.posterior.size <= FRONT_SHARE:
        return found
    column = np.zeros((1, found.posterior.size))
    sprung_kg = vehicle.empty_mass_kg + found.payload.number
    column[0, FRONT_SHARE] = vehicle.empty_front_share_std_pct * vehicle.empty_mass_kg / sprung_kg
    return found.answered(found.posterior.with_source(Source.EMPTY_SHARE, column))


def _roll_usable_share(batch: Batch) -> float:
    """NaN if the signal map has no roll rate, or no sample of the batch is usable."""
    share = batch.roll_usable_share
    return share if share is not None and batch.usable.any() else math.nan


def _by_cross_spectrum(batch: Batch, calibrated: CalibratedVehicle, blank: Estimate) -> Estimate:
    """Find the load that explains the cross-spectra; add the ratio indexes for display if they are calibrated."""
    if calibrated.cross_spectrum is None:
        return replace(blank, rejected=(Why.NO_CALIBRATION,))
    if calibrated.ratio_index is not None:
        ra, rg = indexes_of(batch, calibrated.ratio_index)
        blank = replace(blank, ratio_index_acceleration=ra, ratio_index_pitch_rate=rg)
    return by_cross_spectrum(batch, calibrated.cross_spectrum, calibrated.shapes, blank)


def _by_ratio_index(batch: Batch, calibrated: CalibratedVehicle, blank: Estimate) -> Estimate:
    """The paper's estimator, for comparison."""
    if calibrated.ratio_index is None:
        return replace(blank, rejected=(Why.NO_CALIBRATION,))
    found = by_ratio_index(batch, calibrated.ratio_index, blank)
    if found.counted and found.payload.std > MOST_PAYLOAD_STD_SHARE * calibrated.vehicle.empty_mass_kg:
        return found.refused(Why.TOO_UNCERTAIN)
    return found


ESTIMATORS: Mapping[str, Estimator] = MappingProxyType(
    {BY_MODEL: _by_cross_spectrum, "ratio_index": _by_ratio_index}  # the better first
)
