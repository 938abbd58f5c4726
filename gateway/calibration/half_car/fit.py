"""Calibration of the cross-spectral estimator: a half-car fitted to drives of known load.

    calibrate_cross_spectrum(runs, vehicle) -> CrossSpectrumCalibration
    fit_cross_spectrum(runs, vehicle) -> the same, and what the other runs taught without each run

The parameters are those most probable given all runs together, under priors any road vehicle
would meet. Leaving out one run at a time then shows how far the intervals must be widened to be valid for loads that
calibration has not seen.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count, product
from math import isfinite, nan
from statistics import fmean
from typing import Final

import numpy as np

from gateway.calibration.half_car.known_spectra import KnownSpectra, known_spectra
from gateway.calibration.half_car.left_out import (
    UNTESTED_MISFITS,
    LeftOut,
    left_out_errors,
    limits_shown_by,
    model_error,
    most_misfit,
)
from gateway.calibration.half_car.most_probable_vehicle import fit_vehicle, seen_by
from gateway.calibration.half_car.prior import Inherited, Prior, can_roll, prior_of
from gateway.calibration.known_run import KnownRun
from gateway.core.bends import joined_gains
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.estimator import moves_of, weigh
from gateway.core.cross_spectrum.floor import usual_floor
from gateway.core.cross_spectrum.likelihood import Point, Whittle
from gateway.core.cross_spectrum.located import raw_moves
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, names_of, upright
from gateway.core.cross_spectrum.predicted import Drive, expected_of, steady_spectra
from gateway.core.cross_spectrum.search import Found
from gateway.core.vehicle import Load, Vehicle, front_share_pct
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64, Why

MOST: Final = 8  # chosen: they carry 98 % and more of the payload's variance; the rest counts as the model's error
SCALES: Final = np.array([10.0, 0.2, 0.005])  # chosen: kg, %, m of equal weight


def directions_of(moves: Sequence[F64], covariance: F64) -> F64:
    """(n, k) with independent causes of unit variance as columns.

    ``moves`` has, for each load, the derivatives (d, n) of payload (kg), front share (%) and lateral place (m) by the n
    parameters.
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    rows = np.concatenate([one / SCALES[: len(one), None] for one in moves])
    _, _, directions = np.linalg.svd(rows @ root, full_matrices=False)
    found: F64 = root @ directions[:MOST].T
    return found


LEAST_RUNS_TO_LEAVE_ONE_OUT: Final = 3  # two must remain for a scale
SPRINGS_FROM_PRIORS: Final = "springs_from_priors"
UNTESTED: Final = "intervals_untested"

IDEAL_S: Final = 300.0  # BatchSettings.window_s
IDEAL_PARTS: Final = (0.02, 0.5, 1.0)  # chosen: of the payload range
IDEAL_PLACES: Final = (0.25, 0.6, 0.95)  # chosen: of the wheelbase

_STARTS: Final = ((0.0, 0.0), (0.4, 0.3), (-0.4, -0.3))  # log springs, log dampers, off the prior's centre


@dataclass(frozen=True, slots=True)
class CrossSpectrumFit:
    """The calibration, and by run number the calibration from all other runs; empty if too few to leave one out.

    The errors (n,) are those of every batch of a run left out, weighed by the others; None if there are none.
    """

    calibration: CrossSpectrumCalibration
    without: Mapping[int, CrossSpectrumCalibration]
    payload_errors_kg: F64 | None = None
    front_share_errors_pct: F64 | None = None


def calibrate_cross_spectrum(runs: Sequence[KnownRun], vehicle: Vehicle) -> CrossSpectrumCalibration:
    """The calibration alone; see :func:`fit_cross_spectrum`."""
    return fit_cross_spectrum(runs, vehicle).calibration


def fit_cross_spectrum(
    runs: Sequence[KnownRun],
    vehicle: Vehicle,
    progress: Callable[[int, int], None] | None = None,
    inherited: Inherited | None = None,
) -> CrossSpectrumFit:
    """Fit the half-car to ``runs``; one empty run is enough, then with the warning ``springs_from_priors``.

    ``inherited`` is the prior from a vehicle of the same model; it replaces the prior of any vehicle.
    ``progress`` is called with (steps done, steps in all). Raises CalibrationImpossibleError if no run has enough
    steady driving.
    """
    usual = inherited.usual if inherited else None
    known = known_spectra(runs, vehicle, with_roll=can_roll(vehicle), usual=usual)
    with_roll = known[0].spectra.roll is not None
    prior = (inherited.prior_of if inherited else prior_of)(vehicle, with_roll=with_roll)
    shifts = _STARTS[:1] if inherited else _STARTS  # the sister's prior selects the peak
    can_leave_out = len(known) >= LEAST_RUNS_TO_LEAVE_ONE_OUT
    step = _counted(progress, len(shifts) + (2 * len(shifts) + len(known)) * can_leave_out)

    def taught(by: Sequence[KnownSpectra], found: Found) -> CrossSpectrumCalibration:
        untested = half_car_calibration(by, vehicle, found, inherits=inherited is not None)
        return inherited.on(untested, is_tested=False) if inherited else untested

    calibration = taught(known, _from_priors(known, prior, shifts, step))
    if not isfinite(calibration.misfit_limit):
        raise CalibrationImpossibleError(
            "hardly two stretches were driven at one speed, so the fit of the half-car cannot be tested: drive at an "
            "even speed"
        )
    calibration = replace(calibration, directions=_directions(calibration, vehicle, runs))
    untested = calibration if inherited else _untested(calibration)
    if not can_leave_out:
        return CrossSpectrumFit(untested, {})
    errors: list[LeftOut] = []
    without: dict[int, CrossSpectrumCalibration] = {}
    for one, others, start in _left_out_in_turn(known, prior, shifts, step):
        without[one.run.number] = taught(others, fit_vehicle(others, prior, [start]))
        errors.extend(left_out_errors(one, without[one.run.number]))
        step()
    if not errors:
        return CrossSpectrumFit(untested, {})
    limits = limits_shown_by(errors, calibration.misfit_limit, vehicle.empty_mass_kg)

    def tested(one: CrossSpectrumCalibration) -> CrossSpectrumCalibration:
        shown = limits.on(one, is_tested=False)
        return inherited.on(shown, is_tested=True) if inherited else shown

    tested_without = {number: tested(one) for number, one in without.items()}
    payload_kg, share_pct = np.array([one.error[:2] for one in errors]).T
    return CrossSpectrumFit(tested(calibration), tested_without, payload_kg, share_pct)


def _untested(calibration: CrossSpectrumCalibration) -> CrossSpectrumCalibration:
    """With the model error of other vans, since no run could be left out."""
    usual = model_error((), calibration.empty_mass_kg)
    warnings = (*calibration.warnings, UNTESTED)
    return replace(calibration, model_std=usual.std, model_per_reach=usual.per_reach, warnings=warnings)


def _directions(calibration: CrossSpectrumCalibration, vehicle: Vehicle, runs: Sequence[KnownRun]) -> F64:
    """Over the known runs, and over loads that the vehicle may carry at the speed of these runs."""
    moves = []
    for run in runs:
        batch = next((one for one in run.batches if not one.rejected), None)
        found = None if batch is None else weigh(batch, calibration, None)
        if found is not None and not isinstance(found, Why):
            moves.append(moves_of(found.located, len(calibration.parameters)))
    speed_mps = float(np.mean(calibration.speed_seen_mps))
    theta, ground = upright(calibration.parameters), calibration.ground
    spectra = steady_spectra(calibration.reading, Drive(IDEAL_S, speed_mps))
    most_kg = max(vehicle.payload_range_kg[1], calibration.payload_seen_kg[1])
    for part, place in product(IDEAL_PARTS, IDEAL_PLACES):
        payload_kg = part * most_kg
        share_pct = front_share_pct(vehicle, payload_kg, place * vehicle.wheelbase_m)
        point = Point.of(theta, Load(payload_kg, share_pct))
        _, by_parameter = raw_moves(Whittle(expected_of(spectra, point, ground), ground), point)
        moved = np.zeros((2, len(calibration.parameters)))
        moved[:, : len(PARAMETERS)] = np.diag([1.0, 100.0]) @ by_parameter
        moves.append(moved)
    return directions_of(moves, calibration.covariance)


def _counted(progress: Callable[[int, int], None] | None, n_steps: int) -> Callable[[], None]:
    """To be called after each step."""
    done = count(1)

    def step() -> None:
        if progress is not None:
            progress(next(done), n_steps)

    return step


def _from_priors(
    known: Sequence[KnownSpectra], prior: Prior, shifts: Sequence[tuple[float, float]], step: Callable[[], None]
) -> Found:
    """The most probable of the results from each start: the posterior may have several peaks."""
    return fit_vehicle(known, prior, [prior.start(*shift) for shift in shifts], step)


def _left_out_in_turn(
    known: Sequence[KnownSpectra], prior: Prior, shifts: Sequence[tuple[float, float]], step: Callable[[], None]
) -> Iterator[tuple[KnownSpectra, list[KnownSpectra], F64]]:
    """Each run, all others, and a start (p,) for their fit in which that run had no part.

    Every second run is of one half, the rest of the other: the start is the result, from the priors, of the half
    without the run. That costs a quarter of trying all of _STARTS for every run, and reaches the same peak.
    """
    starts = [_from_priors(half, prior, shifts, step).x for half in (known[1::2], known[::2])]
    for i, one in enumerate(known):
        yield one, [k for k in known if k is not one], starts[i % 2]


def half_car_calibration(
    known: Sequence[KnownSpectra], vehicle: Vehicle, found: Found, *, inherits: bool = False
) -> CrossSpectrumCalibration:
    """The calibration from the known runs, its intervals not yet tested on any run left out."""
    seen = seen_by(known, found.x)
    reading = seen[0].spectra.reading
    runs = [k.run for k in known]
    payloads, shares = [r.payload_kg for r in runs], [r.front_share_pct for r in runs]
    speeds = [batch.mean_speed_mps for run in runs for batch in run.batches if not batch.rejected]
    misfits = [k.whittle.misfit(k.at(upright(found.x))) for k in seen]
    return CrossSpectrumCalibration(
        empty_mass_kg=vehicle.empty_mass_kg,
        empty_front_share_pct=vehicle.empty_front_share_pct,
        wheelbase_m=vehicle.wheelbase_m,
        band_hz=reading.band_hz,
        n_segment=reading.n_segment,
        names=names_of(found.x),
        parameters=found.x,
        covariance=found.covariance,
        directions=np.zeros((len(found.x), 0)),
        model_std=(0.0, 0.0, 0.0),
        misfit_limit=most_misfit(misfits)
        if inherits
        else UNTESTED_MISFITS * max(filter(isfinite, misfits), default=nan),
        acceleration_rms_mps2=float(np.median([k.spectra.acceleration_rms_mps2 for k in known])),
        pitch_rate_rms_radps=float(np.median([k.spectra.pitch_rate_rms_radps for k in known])),
        payload_seen_kg=(min(payloads), max(payloads)),
        front_share_seen_pct=(min(shares), max(shares)),
        speed_seen_mps=(min(speeds), max(speeds)),
        warnings=(SPRINGS_FROM_PRIORS,) if len({*payloads}) == 1 else (),
        known_loads=tuple(run.load for run in runs),
        usual_log_amplitude=reading.usual_log_amplitude,
        track_width_m=vehicle.track_width_m,
        sensor_left_m=vehicle.sensor_left_m,
        sensor_left_std_m=vehicle.sensor_left_std_m,
        least_slack=known[0].whittle.ground.least_slack,
        usual_stroke_mps=reading.usual_stroke_mps,
        gravity_mps2=fmean(b.gravity_mps2 for run in runs for b in run.batches if not b.rejected),
        floor=usual_floor((b for run in runs for b in run.batches if not b.rejected), with_roll=reading.with_roll),
        gyro_gain=joined_gains([b.gyro_gain for run in runs for b in run.batches if not b.rejected]),
    )
