"""The load that a batch's spectra tell: the best point of the posterior, and what is uncertain about it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import DRIFT_PRECISION, DRIFTING, STEADY, drift_covariance, tension_of
from gateway.core.cross_spectrum.lateral.sought import ROLL_BAND_HZ, Sideways, sought_sideways, told_sideways
from gateway.core.cross_spectrum.lateral.unseen import sideways_covariance
from gateway.core.cross_spectrum.likelihood import EVIDENCE_WEIGHT, Curvature, Point, Whittle
from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS, has_roll, level, upright
from gateway.core.cross_spectrum.model.strokes import with_strokes
from gateway.core.cross_spectrum.packing import Packing, packings
from gateway.core.cross_spectrum.search import Found, most_probable
from gateway.core.cross_spectrum.sensor_change import FITTED, SensorScores, gain_moves, scores_of, weighed
from gateway.core.cross_spectrum.spread import as_carried, spread_covariance
from gateway.records import F64

START_PAYLOADS_N: Final = 6  # from nothing to the most seen in calibration, or a third of the empty mass
LEAST_START_SHARE: Final = 0.33
STARTS_TRIED: Final = 2  # the posterior may have two peaks where a spring's rate bends
COARSE: Final = 0.5  # of evidence, which tells peaks apart
FINE: Final = 1e-3
MOST_RIVALRY: Final = 1.0
"""Of all other variance: where peaks that compete are most of what is uncertain, that is why."""
START_POSITION_SHARES: Final = (0.25, 0.5, 0.9)  # of the wheelbase

_GYRATION: Final = STEADY.index(INDEX["payload_gyration_m2"])


@dataclass(frozen=True, slots=True)
class Located:
    """The best point of a batch with its covariance of (payload in kg, front share 0..1), not yet inflated.

    own_covariance is the part of it that no other batch shares: what its length and road leave. drift_covariance is
    what a change of the vehicle since its calibration adds, gain_moves (2,) by how much the load moves with the
    accelerometer's gain: no inflation is due on these, but on rival_covariance, what peaks add that compete. Without a
    roll rate drift_covariance holds too what a load does that lies sideways. tension is how far what drifts lies off
    its calibration (drift.tension_of). sideways is None without a roll rate.
    """

    point: Point
    load_covariance: F64
    own_covariance: F64
    drift_covariance: F64
    gain_moves: F64
    misfit: float
    tension: float
    scores: SensorScores
    is_reversed: bool
    is_ambiguous: bool
    rival_covariance: F64
    sideways: Sideways | None = None


@dataclass(frozen=True, slots=True)
class _Peak:
    """A peak of the posterior, with the packing under which it was sought."""

    found: Found
    packing: Packing
    rivals: F64 = field(default_factory=lambda: np.zeros((2, 2)))  # what others add to its covariance


def locate(spectra: CrossSpectra, calibration: CrossSpectrumCalibration) -> Located:
    """The most probable load of ``spectra`` under a flat prior on payload and share.

    How much each axle moves goes with the load, so that it is told anew at each answer, and the load sought on from
    there. With a roll rate the load is first sought as if it lay on the centre line; then roll tells where it lies, and
    the load is sought once more from there. Where the roll rate is lost, the sensor reads roll all the same: it is
    taken to sit where calibration has it, with the load on the centre line. How long it lies is never sought (spread).
    """
    calibration = as_carried(calibration)
    if spectra.roll is None or not has_roll(calibration.parameters):
        whittle, peak = _best(spectra.without_roll, calibration)
        located = _told(whittle, peak, calibration, 0.0)

        def weigh(other: CrossSpectra) -> F64:
            sought = _sought(Whittle(other, calibration.ground), peak.found.x, peak.packing, calibration, 0.0, COARSE)
            return sought.x[-2:]

        unseen = sideways_covariance(whittle.spectra, located.point, calibration, weigh)
        return replace(located, drift_covariance=located.drift_covariance + unseen)
    placed = replace(calibration, parameters=level(calibration.parameters))
    _, peak = _best(spectra.without_roll, replace(calibration, parameters=upright(calibration.parameters)))
    moving = _moving(spectra, peak.found.x, placed)
    whittle = Whittle(moving.without_roll, calibration.ground)
    rolling = Whittle(moving.within(ROLL_BAND_HZ), calibration.ground)
    place = sought_sideways(rolling, _point(peak.found.x, placed, 0.0))
    peak = replace(peak, found=_sought(whittle, peak.found.x, peak.packing, placed, place.cg_left_m))
    place = sought_sideways(rolling, _point(peak.found.x, placed, place.cg_left_m))
    located = _told(whittle, peak, placed, place.cg_left_m)
    return replace(located, sideways=told_sideways(rolling, place, located.point, placed.covariance))


def _told(whittle: Whittle, peak: _Peak, calibration: CrossSpectrumCalibration, cg_left_m: float) -> Located:
    found = peak.found
    point = _point(found.x, calibration, cg_left_m)
    n = len(point.theta)
    whole = whittle.curvature(point, [*range(len(PARAMETERS)), n, n + 1])
    # the fitted x moves by -C I_xt for each of the other parameters t
    moves = -found.covariance @ whole.information[np.ix_(FITTED, STEADY)]
    misfit = whittle.misfit(point)
    parameters = calibration.parameters.copy()
    parameters[DRIFTING] = peak.packing.drifting
    expected = replace(calibration, parameters=parameters)
    load_covariance = _load_covariance(found, moves, calibration)
    drifted = drift_covariance(found.covariance, moves)[-2:, -2:]
    drifted += spread_covariance(moves[-2:, _GYRATION], point.payload_kg, calibration)
    covariance = load_covariance + drifted
    return Located(
        point=point,
        load_covariance=load_covariance,
        own_covariance=found.covariance[-2:, -2:],
        drift_covariance=drifted,
        gain_moves=gain_moves(whole, whittle, point, found.covariance)[-2:],
        misfit=misfit,
        tension=min(tension_of(found.x[:-2] - one.drifting) for one in packings(calibration.parameters)),
        scores=scores_of(whole, point, found.covariance, expected),
        is_reversed=_is_reversed(whittle, point, misfit, calibration),
        is_ambiguous=bool(np.any(np.diag(peak.rivals) > MOST_RIVALRY * np.diag(covariance))),
        rival_covariance=peak.rivals,
    )


def _is_reversed(whittle: Whittle, point: Point, misfit: float, calibration: CrossSpectrumCalibration) -> bool:
    """True where the pitch rate fits better with the other sign: at this load or, if this fits badly, at any start.

    Spectra with the wrong sign may drive the search to where neither sign fits.
    """
    reverse = Whittle(whittle.spectra.with_pitch_reversed(), calibration.ground)
    tried = [point]
    if not misfit <= calibration.misfit_limit:
        usual = calibration.parameters[DRIFTING]
        tried += [_point(np.r_[usual, load], calibration, point.cg_left_m) for load in _starting_loads(calibration)]
    return float(reverse.costs(tried).min()) < whittle.cost(point)


def _point(x: F64, calibration: CrossSpectrumCalibration, cg_left_m: float) -> Point:
    """Of drifting parameters, payload and front share."""
    theta = calibration.parameters.copy()
    theta[DRIFTING] = x[:-2]
    return Point(theta, float(x[-2]), float(x[-1]), cg_left_m)


def _moving(spectra: CrossSpectra, x: F64, calibration: CrossSpectrumCalibration) -> CrossSpectra:
    """The same with how much each axle of the calibrated vehicle moves under the load at x."""
    load = _point(x, calibration, 0.0).load
    return with_strokes(spectra, calibration.parameters, load, calibration.ground)


def _best(spectra: CrossSpectra, calibration: CrossSpectrumCalibration) -> tuple[Whittle, _Peak]:
    """The best of the peaks that a few starting loads, firm and soft, lead to, and how far the others compete; before
    it the likelihood under which it was sought.
    """
    whittle = Whittle(spectra, calibration.ground)
    peaks = []
    for packing, n in zip(packings(calibration.parameters), (STARTS_TRIED, 1), strict=True):
        starts = [np.r_[packing.drifting, load] for load in _starting_loads(calibration)]
        costs = whittle.costs([_point(x, calibration, 0.0) for x in starts])
        tried = [starts[i] for i in np.argsort(costs, kind="stable")[:n].tolist()]
        peaks += [_Peak(_sought(whittle, one, packing, calibration, 0.0, COARSE), packing) for one in tried]
    best = min(peaks, key=lambda peak: peak.found.cost + peak.packing.decisive)
    whittle = Whittle(_moving(spectra, best.found.x, calibration), calibration.ground)
    found = _sought(whittle, best.found.x, best.packing, calibration, 0.0)
    return whittle, _Peak(found, best.packing, _rivalry(found, peaks))


def _rivalry(found: Found, peaks: Sequence[_Peak]) -> F64:
    """(2, 2) what peaks elsewhere add to the covariance about the best, each by how probable it is.

    A batch repeats one error of the model: its evidence counts as little as it does in calibration.
    """
    away = np.array([peak.found.x[-2:] - found.x[-2:] for peak in peaks])
    costs = np.array([peak.found.cost + peak.packing.cost for peak in peaks])
    weights = np.exp(-EVIDENCE_WEIGHT * (costs - costs.min()))
    spread: F64 = (away.T * (weights / weights.sum())) @ away
    return spread


def _sought(
    whittle: Whittle,
    start: F64,
    packing: Packing,
    calibration: CrossSpectrumCalibration,
    cg_left_m: float,
    tolerance: float = FINE,
) -> Found:
    """Drift parameters, then payload (kg) and front share (0..1), of the peak that ``start`` leads to."""
    prior_mean = np.r_[packing.drifting, 0.0, 0.0]
    prior_precision = np.pad(DRIFT_PRECISION, (0, 2))  # flat in payload and share

    def cost(x: F64) -> float:
        return whittle.cost(_point(x, calibration, cg_left_m))

    def curvature(x: F64) -> Curvature:
        point = _point(x, calibration, cg_left_m)
        return whittle.curvature(point, weighed(point))

    return most_probable(start, prior_mean, prior_precision, cost, curvature, tolerance)


def _starting_loads(calibration: CrossSpectrumCalibration) -> list[tuple[float, float]]:
    """(payload in kg, front share 0..1) for a few loads at a few places."""
    empty_kg, share = calibration.empty_mass_kg, calibration.ground.empty_front_share
    loads = []
    most_kg = max(calibration.payload_seen_kg[1], LEAST_START_SHARE * empty_kg)
    for payload_kg in np.linspace(0.0, most_kg, START_PAYLOADS_N).tolist():
        for position in START_POSITION_SHARES if payload_kg else (0.5,):
            front_kg = share * empty_kg + (1.0 - position) * payload_kg
            loads.append((payload_kg, front_kg / (empty_kg + payload_kg)))
    return loads


def _load_covariance(found: Found, moves: F64, calibration: CrossSpectrumCalibration) -> F64:
    """Covariance (2, 2) of payload and share: the batch's own, and what calibration left open."""
    covariance = found.covariance + moves @ calibration.covariance[np.ix_(STEADY, STEADY)] @ moves.T
    return covariance[-2:, -2:]
