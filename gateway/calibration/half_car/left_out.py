"""Batches of runs, or of vehicles, that were left out of a fit and weighed by what it taught: what they show of it."""

from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace
from typing import Final

import numpy as np

from gateway.calibration.half_car.inflation import inflation_of, of_places
from gateway.calibration.half_car.known_spectra import KnownSpectra
from gateway.calibration.half_car.limits import Limits
from gateway.core.cross_spectrum.calibration import SCORE, CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import MOST_TENSION
from gateway.core.cross_spectrum.located import Located, locate
from gateway.core.cross_spectrum.measured import cross_spectra_of
from gateway.core.cross_spectrum.reach import beyond

MISFIT_MARGIN: Final = 3.0
SCORE_MARGIN: Final = 1.5
"""For other roads and loads than those of calibration. Chosen; `benchmarks.accuracy sensitivity` tells what they do."""


@dataclass(frozen=True, slots=True)
class LeftOut:
    """A batch of a run that the others weighed: errors in their own standard deviations, errors in kg and percentage
    points, and how far the load that was found lies beyond the others'. The misfit is NaN where the run itself does,
    the place's error where nobody noted where the payload lay, or no roll rate tells.
    """

    payload_z: float
    front_share_z: float
    misfit: float
    payload_kg: float
    front_share_pct: float
    reach: float
    position_score: float
    noise_score: float
    place_z: float


def left_out_errors(one: KnownSpectra, calibration: CrossSpectrumCalibration) -> list[LeftOut]:
    """Every batch of a run that ``calibration`` has not seen."""
    errors = []
    calibration = replace(calibration, payload_length_m=None)  # a known load, whatever else is carried
    truth = one.run.load
    is_among = beyond(truth, calibration.known_loads, calibration.empty_mass_kg) == 0.0
    for batch in one.run.batches:
        spectra = cross_spectra_of([batch], calibration.reading)
        if spectra is None or batch.rejected:
            continue
        located = locate(spectra, calibration)
        if located.tension > MOST_TENSION:  # the service would refuse it
            continue
        reach = beyond(located.point.load, calibration.known_loads, calibration.empty_mass_kg)
        payload_std_kg, share_std = np.sqrt(np.diag(located.load_covariance))
        payload_kg = located.point.payload_kg - truth.payload_kg
        share = located.point.front_share - truth.front_share
        errors.append(
            LeftOut(
                payload_z=payload_kg / payload_std_kg,
                front_share_z=share / share_std,
                misfit=located.misfit if is_among else np.nan,
                payload_kg=payload_kg,
                front_share_pct=100.0 * share,
                reach=reach,
                position_score=abs(located.scores.position),
                noise_score=located.scores.noise,
                place_z=_place_z(one, located),
            )
        )
    return errors


def _place_z(one: KnownSpectra, located: Located) -> float:
    """Error of the centre of gravity's lateral place in its own standard deviations."""
    run, found = one.run, located.sideways
    if found is None or (run.payload_kg > 0.0 and run.payload_left_m is None):
        return np.nan
    truth_m = one.placed(located.point.theta, 0.0).cg_left_m
    by_load = found.moves_with_load @ located.load_covariance @ found.moves_with_load
    return float((found.cg_left_m - truth_m) / np.sqrt(found.variance + by_load))


def limits_shown_by(errors: Sequence[LeftOut], misfit_limit: float) -> Limits:
    """What these ask for; ``misfit_limit`` is what the fit of all asks for."""
    columns = np.array([astuple(one) for one in errors]).T
    payload_z, share_z, misfits, _, _, reach, position_scores, noise_scores, place_z = columns
    of_payload, of_share = inflation_of(payload_z, reach), inflation_of(share_z, reach)
    return Limits(
        payload_inflation=of_payload.within,
        payload_inflation_per_reach=of_payload.per_reach,
        front_share_inflation=of_share.within,
        front_share_inflation_per_reach=of_share.per_reach,
        cg_left_inflation=of_places(place_z[np.isfinite(place_z)]),
        misfit_limit=max(misfit_limit, MISFIT_MARGIN * float(np.nanmax([0.0, *misfits]))),
        most_position_score=max(SCORE, SCORE_MARGIN * float(np.max(position_scores))),
        most_noise_score=max(SCORE, SCORE_MARGIN * float(np.max(noise_scores))),
    )
