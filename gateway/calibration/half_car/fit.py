"""Calibration of the cross-spectral estimator: a half-car fitted to drives of known load.

    calibrate_cross_spectrum(runs, vehicle) -> CrossSpectrumCalibration
    fit_cross_spectrum(runs, vehicle) -> the same, and what the other runs taught without each run

The parameters are those most probable given all runs together, under priors any road vehicle
would meet. Leaving out one run at a time then shows how far the intervals must be widened to be
true of loads that calibration has not seen.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from itertools import count
from statistics import fmean
from typing import Final

import numpy as np

from gateway.calibration.half_car.inflation import UNTESTED as UNTESTED_INFLATION
from gateway.calibration.half_car.inflation import inflation_of
from gateway.calibration.half_car.known_spectra import KnownSpectra, known_spectra
from gateway.calibration.half_car.prior import Prior, prior_of
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.calibration import SCORE, CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import MOST_TENSION
from gateway.core.cross_spectrum.estimator import locate
from gateway.core.cross_spectrum.likelihood import Curvature
from gateway.core.cross_spectrum.measured import cross_spectra_of
from gateway.core.cross_spectrum.model.parameters import PARAMETERS
from gateway.core.cross_spectrum.reach import beyond
from gateway.core.cross_spectrum.search import Found, most_probable
from gateway.core.vehicle import Vehicle
from gateway.records import F64

LEAST_RUNS_TO_LEAVE_ONE_OUT: Final = 3
MISFIT_MARGIN: Final = 3.0
SCORE_MARGIN: Final = 1.5
"""For other roads and loads than those of calibration. Chosen; docs/sensitivity.md says what hangs on both."""
SPRINGS_FROM_PRIORS: Final = "springs_from_priors"
UNTESTED: Final = "intervals_untested"

_STARTS: Final = ((0.0, 0.0), (0.4, 0.3), (-0.4, -0.3))  # log springs, log dampers, off the prior's centre


@dataclass(frozen=True, slots=True)
class CrossSpectrumFit:
    """The calibration, and by run number what all other runs teach; empty where too few to leave one out.

    The errors (n,) are those of every batch of a run left out, weighed by the others; None where none could be.
    """

    calibration: CrossSpectrumCalibration
    without: Mapping[int, CrossSpectrumCalibration]
    payload_errors_kg: F64 | None = None
    front_share_errors_pct: F64 | None = None


def calibrate_cross_spectrum(runs: Sequence[KnownRun], vehicle: Vehicle) -> CrossSpectrumCalibration:
    """The calibration alone; see :func:`fit_cross_spectrum`."""
    return fit_cross_spectrum(runs, vehicle).calibration


def fit_cross_spectrum(
    runs: Sequence[KnownRun], vehicle: Vehicle, progress: Callable[[int, int], None] | None = None
) -> CrossSpectrumFit:
    """Fit the half-car to ``runs``; one empty run is enough, then with the warning ``springs_from_priors``.

    ``progress`` is called with (steps done, steps in all). Raises CalibrationImpossibleError where no
    run holds enough steady driving.
    """
    known = known_spectra(runs, vehicle)
    prior = prior_of(vehicle)
    can_leave_out = len(known) >= LEAST_RUNS_TO_LEAVE_ONE_OUT
    step = _counted(progress, len(_STARTS) + (2 * len(_STARTS) + len(known)) * can_leave_out)
    found = _from_priors(known, prior, step)
    calibration = half_car_calibration(known, vehicle, found)
    if not can_leave_out:
        return CrossSpectrumFit(replace(calibration, warnings=(*calibration.warnings, UNTESTED)), {})
    errors: list[_LeftOut] = []
    without: dict[int, CrossSpectrumCalibration] = {}
    for one, others, start in _left_out_in_turn(known, prior, step):
        without[one.run.number] = half_car_calibration(others, vehicle, fit_half_car(others, prior, start))
        errors.extend(_left_out_errors(one, without[one.run.number]))
        step()
    if not errors:
        return CrossSpectrumFit(replace(calibration, warnings=(*calibration.warnings, UNTESTED)), {})
    columns = np.array([astuple(one) for one in errors]).T
    payload_z, share_z, misfits, payload_kg, share_pct, reach, position_scores, noise_scores = columns
    of_payload, of_share = inflation_of(payload_z, reach), inflation_of(share_z, reach)

    def tested(untested: CrossSpectrumCalibration) -> CrossSpectrumCalibration:
        return replace(
            untested,
            payload_inflation=of_payload.within,
            payload_inflation_per_reach=of_payload.per_reach,
            front_share_inflation=of_share.within,
            front_share_inflation_per_reach=of_share.per_reach,
            most_position_score=max(SCORE, SCORE_MARGIN * float(np.max(position_scores))),
            most_noise_score=max(SCORE, SCORE_MARGIN * float(np.max(noise_scores))),
            misfit_limit=max(calibration.misfit_limit, MISFIT_MARGIN * float(np.nanmax([0.0, *misfits]))),
        )

    tested_without = {number: tested(one) for number, one in without.items()}
    return CrossSpectrumFit(tested(calibration), tested_without, payload_kg, share_pct)


def _counted(progress: Callable[[int, int], None] | None, n_steps: int) -> Callable[[], None]:
    """To be called after each step."""
    done = count(1)

    def step() -> None:
        if progress is not None:
            progress(next(done), n_steps)

    return step


def _from_priors(known: Sequence[KnownSpectra], prior: Prior, step: Callable[[], None]) -> Found:
    """The most probable of what is found from each of _STARTS: the posterior need not have one peak."""
    tried = []
    for shift in _STARTS:
        tried.append(fit_half_car(known, prior, prior.start(*shift)))
        step()
    return min(tried, key=lambda one: one.cost)


def _left_out_in_turn(
    known: Sequence[KnownSpectra], prior: Prior, step: Callable[[], None]
) -> Iterator[tuple[KnownSpectra, list[KnownSpectra], F64]]:
    """Each run, all others, and a start (p,) for their fit in which that run had no part.

    Every second run is of one half, the rest of the other: the start is what the half without the run has found from
    the priors. That costs a quarter of trying all of _STARTS for every run, and comes out at the same peak.
    """
    starts = [_from_priors(half, prior, step).x for half in (known[1::2], known[::2])]
    for i, one in enumerate(known):
        yield one, [k for k in known if k is not one], starts[i % 2]


def fit_half_car(known: Sequence[KnownSpectra], prior: Prior, start: F64) -> Found:
    """The most probable parameters (p,) of all known runs together, found from ``start`` (p,)."""
    everything = list(range(len(PARAMETERS)))

    def cost(theta: F64) -> float:
        return sum(k.whittle.cost(k.at(theta)) for k in known)

    def curvature(theta: F64) -> Curvature:
        parts = [k.whittle.curvature(k.at(theta), everything, is_load_free=False) for k in known]
        return Curvature(
            gradient=np.sum([part.gradient for part in parts], axis=0),
            information=np.sum([part.information for part in parts], axis=0),
        )

    return most_probable(start, prior.mean, np.diag(prior.std**-2.0), cost, curvature, tolerance=0.05)


def half_car_calibration(known: Sequence[KnownSpectra], vehicle: Vehicle, found: Found) -> CrossSpectrumCalibration:
    """What the known runs taught, its intervals not yet tested on any run left out."""
    reading = known[0].spectra.reading
    runs = [k.run for k in known]
    payloads, shares = [r.payload_kg for r in runs], [r.front_share_pct for r in runs]
    speeds = [batch.mean_speed_mps for run in runs for batch in run.batches if not batch.rejected]
    misfits = [k.whittle.misfit(k.at(found.x)) for k in known]
    return CrossSpectrumCalibration(
        empty_mass_kg=vehicle.empty_mass_kg,
        empty_front_share_pct=vehicle.empty_front_share_pct,
        wheelbase_m=vehicle.wheelbase_m,
        band_hz=reading.band_hz,
        n_segment=reading.n_segment,
        names=PARAMETERS,
        parameters=found.x,
        covariance=found.covariance,
        payload_inflation=UNTESTED_INFLATION,
        front_share_inflation=UNTESTED_INFLATION,
        misfit_limit=MISFIT_MARGIN * float(np.nanmax(misfits)),
        acceleration_rms_mps2=float(np.median([k.spectra.acceleration_rms_mps2 for k in known])),
        pitch_rate_rms_radps=float(np.median([k.spectra.pitch_rate_rms_radps for k in known])),
        payload_seen_kg=(min(payloads), max(payloads)),
        front_share_seen_pct=(min(shares), max(shares)),
        speed_seen_mps=(min(speeds), max(speeds)),
        warnings=(SPRINGS_FROM_PRIORS,) if len({*payloads}) == 1 else (),
        known_loads=tuple(run.load for run in runs),
        usual_log_amplitude=reading.usual_log_amplitude,
        gravity_mps2=fmean(b.gravity_mps2 for run in runs for b in run.batches if not b.rejected),
    )


@dataclass(frozen=True, slots=True)
class _LeftOut:
    """A batch of a run that the others weighed: errors in their own standard deviations, errors in kg and percentage
    points, and how far the load that was found lies beyond the others'. The misfit is NaN where the run itself does.
    """

    payload_z: float
    front_share_z: float
    misfit: float
    payload_kg: float
    front_share_pct: float
    reach: float
    position_score: float
    noise_score: float


def _left_out_errors(one: KnownSpectra, calibration: CrossSpectrumCalibration) -> list[_LeftOut]:
    """Every batch of a run that ``calibration`` has not seen."""
    errors = []
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
            _LeftOut(
                payload_z=payload_kg / payload_std_kg,
                front_share_z=share / share_std,
                misfit=located.misfit if is_among else np.nan,
                payload_kg=payload_kg,
                front_share_pct=100.0 * share,
                reach=reach,
                position_score=abs(located.scores.position),
                noise_score=located.scores.noise,
            )
        )
    return errors
