"""The most probable load of a batch's spectra: the maximum of the posterior and its derivatives by every cause."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from gateway.core.cargo import ShapePrior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import (
    DRIFTING,
    NATURE_OF_STEADY,
    STEADY,
    dampers_of,
    day_columns,
    drift_precision,
    packing_columns,
    strain_of,
    tension_of,
)
from gateway.core.cross_spectrum.lateral import (
    ROLL_BAND_HZ,
    Sideways,
    most_probable_place,
    sideways_at,
    sideways_columns,
)
from gateway.core.cross_spectrum.likelihood import EVIDENCE_WEIGHT, Curvature, Point, Whittle
from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS, has_roll, level
from gateway.core.cross_spectrum.model.strokes import with_strokes
from gateway.core.cross_spectrum.packing import LEAST_STRAIN, Packing, packings, worn
from gateway.core.cross_spectrum.search import Found, most_probable
from gateway.core.cross_spectrum.sensor_change import FITTED, SensorScores, gain_moves, scores_of, weighed
from gateway.core.cross_spectrum.shape import EVIDENCE, EVIDENCE_WITHOUT_ROLL, Node, Shaped, Waypoint, shaped
from gateway.core.cross_spectrum.soft_mass import SoftMass, soft_mass_of
from gateway.core.vehicle import Load
from gateway.posterior import NORMAL_TAILS, Source
from gateway.records import F64

START_PAYLOADS_N: Final = 6  # chosen: from 0 to the largest calibrated payload, or a third of the empty mass
LEAST_START_SHARE: Final = 0.33  # chosen: of the empty mass
STARTS_TRIED: Final = 2  # chosen: a bend of a spring's rate can cause two peaks
COARSE: Final = 0.5  # chosen: tolerance in log-likelihood, enough to distinguish peaks
FINE: Final = 1e-3  # chosen: tolerance of the final search
MOST_LOAD_SHARE: Final = 4.0  # chosen: of the empty mass; bound of the search
FIRM_HZ: Final = 25.0
"""Chosen: a load with a lower resonance on its mount also rotates there, which the model lacks; the evidence on its
shape is reduced by the square of the ratio.
"""
OF_SHAPES: Final = 0.02  # chosen: tolerance in log-likelihood for the shapes
MOST_RIVALRY: Final = 1.0
"""Chosen: of all other variance; above it competing peaks are the reason of the uncertainty."""
START_POSITION_SHARES: Final = (0.25, 0.5, 0.9)  # chosen: of the wheelbase

_GYRATION: Final = INDEX["payload_gyration_m2"]


@dataclass(frozen=True, slots=True)
class Located:
    """The most probable load of a batch and its uncertainty; a load is payload (kg) and front share (0..1).

    own (2, 2) is the covariance specific to this batch, from its length and road. moves (2, p) is the load's derivative
    by each of the half-car's parameters, columns (c, 2) its change by one standard deviation of each source's causes,
    drifted (c, k) that of the drifting parameters with the day's causes,
    gain_moves (2,) its derivative by the logarithm of the accelerometer's gain. rival_covariance comes from competing
    peaks. tails are those of the error from the load's shape. tension is the distance of the drifting parameters from
    their calibration (drift.tension_of). is_converged is false if a search behind the answer did not converge. freed
    (2,) is the deviation of front and rear dampers from their calibration, in logarithms; without the search's prior
    where it strained at that. sideways is None without a roll rate.
    """

    point: Point
    own: F64
    moves: F64
    columns: Mapping[Source, F64]
    drifted: F64
    tails: tuple[float, float]
    gain_moves: F64
    rival_covariance: F64
    misfit: float
    tension: float
    scores: SensorScores
    soft_mass: SoftMass
    is_reversed: bool
    is_ambiguous: bool
    is_converged: bool
    freed: F64
    as_known: Load  # the load under the assumption of the known loads' shape
    sideways: Sideways | None = None


@dataclass(frozen=True, slots=True)
class _Peak:
    """A peak of the posterior, with the packing assumed in its search."""

    found: Found
    packing: Packing
    rivals: F64 = field(default_factory=lambda: np.zeros((2, 2)))  # what others add to its covariance
    freed: F64 | None = None  # drifting parameters, from a search in which dampers may have worn


def locate(
    spectra: CrossSpectra,
    calibration: CrossSpectrumCalibration,
    prior: ShapePrior | None = None,
    evidence: float | None = None,
) -> Located:
    """The most probable load of ``spectra`` under a flat prior on payload and share.

    ``prior`` is that of its shape and ``evidence`` the weight of the batch against it (None: the default); without a
    prior the load has the shape of the known ones. Each axle's movement depends on the load: we recompute the stroke
    speeds at each solution and continue the search from it. With a roll rate the load is first searched on the centre
    line; then roll gives its lateral place, and the search continues from there. If the roll rate is lost, the sensor
    still reads roll: we assume its calibrated place, and the load on the centre line.
    """
    is_rolling = spectra.roll is not None and has_roll(calibration.parameters)
    if evidence is None:
        evidence = EVIDENCE if is_rolling else EVIDENCE_WITHOUT_ROLL
    if not is_rolling:
        whittle, peak = _best(spectra.without_roll, calibration, precision_of(spectra, calibration))
        shape = _shaped(whittle, peak, calibration, 0.0, prior, evidence)
        located = _located(whittle, peak, shape, calibration, 0.0, evidence)

        def weigh(other: CrossSpectra) -> F64:
            again = _search(Whittle(other, calibration.ground), peak.found.x, peak.packing, calibration, 0.0, COARSE)
            return again.x[-2:]

        as_known = _point(peak.found.x, calibration, 0.0)
        unseen = sideways_columns(whittle.spectra, as_known, calibration, weigh)
        return replace(located, columns={**located.columns, Source.SIDEWAYS: unseen})
    placed = replace(calibration, parameters=level(calibration.parameters))
    _, peak = _best(spectra.without_roll, calibration.upright, precision_of(spectra, calibration))
    moving = _moving(spectra, peak.found.x, placed)
    whittle = Whittle(moving.without_roll, calibration.ground)
    rolling = Whittle(moving.within(ROLL_BAND_HZ), calibration.ground)
    place = most_probable_place(rolling, _point(peak.found.x, placed, 0.0))
    peak = replace(peak, found=_search(whittle, peak.found.x, peak.packing, placed, place.cg_left_m))
    shape = _shaped(whittle, peak, placed, place.cg_left_m, prior, evidence)
    placed = _as_shaped(placed, shape)
    x = peak.found.x if shape is None else shape.x
    place = most_probable_place(rolling, _point(x, placed, place.cg_left_m))
    located = _located(whittle, peak, shape, placed, place.cg_left_m, evidence)
    sideways = sideways_at(rolling, place, located.point, located.drifted)
    return replace(located, sideways=sideways, is_converged=located.is_converged and place.found.is_converged)


def precision_of(spectra: CrossSpectra, calibration: CrossSpectrumCalibration) -> F64:
    """(k, k) prior precision of the drifting parameters for a batch.

    With a roll rate each batch determines its sensors' noise. Without, roll leaks into the sensors and looks like
    noise, so the noise stays as calibrated.
    """
    return drift_precision(is_noise_free=spectra.roll is not None and has_roll(calibration.parameters))


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """The result at the peak of a search, including the STEADY parameters t that the search held fixed.

    whole is the curvature for all parameters and the load, covariance that of the fitted ones (FITTED: drifting
    parameters and load). cost is minus the log evidence by Laplace's approximation, with t integrated out over its
    covariance by calibration and nature. One Gauss-Newton step moves t as far as the batch and the day's drift allow:
    shift (k,) is the resulting change of the fitted parameters, steady (k, s) their derivative by an error of each t
    after that step, marginal (k, k) their covariance with t free to take it, own (k, k) what the step adds to the
    covariance of the answer: by the batch's noise, and by the drift that the search's prior allows.
    """

    whole: Curvature
    covariance: F64
    cost: float
    shift: F64
    steady: F64
    marginal: F64
    own: F64

    @property
    def moves(self) -> F64:
        """(2, p) derivative of the load by each of the half-car's parameters."""
        moves = np.zeros((2, len(PARAMETERS)))
        moves[:, STEADY] = self.steady[-2:]
        return moves


def answer_at(
    whittle: Whittle,
    point: Point,
    calibration: CrossSpectrumCalibration,
    prior: Packing,
    evidence: float,
    *,
    is_shape_known: bool = True,
) -> Answer:
    """The answer at ``point``; ``prior`` is that of the drifting parameters; a shape that is searched is no error of t.

    With g and I the gradient and information of t at the peak and N its covariance by nature, the step is -w (w I +
    N^-1)^-1 g, w being the weight of the batch's evidence. The calibration's own uncertainty takes no step: it rests on
    many drives, and a batch is one.
    """
    n = len(point.theta)
    whole = whittle.curvature(point, [*range(len(PARAMETERS)), n, n + 1])
    covariance = np.asarray(np.linalg.inv(_of_fitted(whole, prior.precision)), float)
    pull = whole.gradient[FITTED].copy()
    off = point.theta[DRIFTING] - prior.drifting
    pull[: len(DRIFTING)] += prior.precision @ off
    free = [i for i in range(len(STEADY)) if is_shape_known or STEADY[i] != _GYRATION]
    t = [STEADY[i] for i in free]
    across = whole.information[FITTED][:, t]
    along = -covariance @ across  # the fitted parameters move by -C I_xt with each t
    gradient = whole.gradient[t] + along.T @ pull
    information = whole.information[t][:, t] + along.T @ across
    nature = NATURE_OF_STEADY[free][:, free]
    unknown = calibration.covariance[t][:, t] + nature
    left_open = np.eye(len(t)) + evidence * unknown @ information
    gained = -0.5 * evidence * float(gradient @ np.linalg.solve(left_open, unknown @ gradient))
    narrowed = 0.5 * float(np.linalg.slogdet(left_open)[1]) / evidence
    narrowing = np.eye(len(t)) + evidence * nature @ information
    posterior = np.linalg.solve(narrowing, nature)
    step = -evidence * posterior @ gradient
    by_noise = along @ posterior * evidence
    steady = np.zeros((len(along), len(STEADY)))
    steady[:, free] = along - by_noise @ information  # along S_posterior S^-1
    marginal = covariance + by_noise @ along.T
    held = _flat_in_load(prior.precision)
    to_peak = -covariance @ pull
    at_peak = whittle.cost(point) + 0.5 * float(off @ prior.precision @ off + pull @ to_peak)
    return Answer(
        whole=whole,
        covariance=covariance,
        cost=at_peak + gained + narrowed,
        shift=to_peak + along @ step,
        steady=steady,
        marginal=marginal,
        own=by_noise @ information @ by_noise.T + marginal @ held @ marginal - covariance @ held @ covariance,
    )


def _of_fitted(whole: Curvature, precision: F64) -> F64:
    """Information on the fitted parameters, prior included."""
    information: F64 = whole.information[FITTED][:, FITTED] + _flat_in_load(precision)
    return information


def _flat_in_load(precision: F64) -> F64:
    """(k + 2, k + 2) prior precision of the fitted parameters, from that of the drifting ones."""
    flat = np.zeros(np.add(precision.shape, 2))
    flat[:-2, :-2] = precision
    return flat


def raw_moves(whittle: Whittle, point: Point) -> tuple[F64, F64]:
    """(2, 2) covariance of a load with all STEADY parameters fixed, and (2, p) its derivative by each of the half-car's
    parameters.
    """
    n = len(point.theta)
    whole = whittle.curvature(point, [*range(len(PARAMETERS)), n, n + 1])
    covariance = np.asarray(np.linalg.inv(_of_fitted(whole, drift_precision())), float)
    moves = np.zeros((2, len(PARAMETERS)))
    moves[:, STEADY] = -(covariance @ whole.information[np.ix_(FITTED, STEADY)])[-2:]
    return covariance[-2:, -2:], moves


def _shaped(
    whittle: Whittle,
    peak: _Peak,
    calibration: CrossSpectrumCalibration,
    cg_left_m: float,
    prior: ShapePrior | None,
    evidence: float,
) -> Shaped | None:
    """The load under every possible shape; None if the shape is known."""
    if prior is None:
        return None

    def weighed_as(log_s: float, start: F64) -> Node:
        of_shape = _with_gyration(calibration, log_s)
        found = _search(whittle, start, peak.packing, of_shape, cg_left_m, OF_SHAPES)
        point = _point(found.near, of_shape, cg_left_m)
        at = answer_at(whittle, point, of_shape, peak.packing, evidence, is_shape_known=False)
        ended = Waypoint(log_s, found.x, -at.covariance @ at.whole.information[FITTED, _GYRATION])
        own_std_kg = float(np.sqrt(at.covariance[-2, -2]))
        return Node(ended, at.cost, found.near + at.shift, own_std_kg, found.is_converged)

    mode_hz = float(np.exp(peak.found.x[DRIFTING.index(INDEX["payload_mode_hz"])]))
    point = _point(peak.found.near, calibration, cg_left_m)
    across = whittle.curvature(point, [*weighed(point), _GYRATION]).information[:-1, -1]
    known_log_s = float(calibration.parameters[_GYRATION])
    start = Waypoint(known_log_s, peak.found.x, -peak.found.covariance @ across)
    return shaped(prior, calibration.wheelbase_m, start, weighed_as, evidence * min(1.0, (mode_hz / FIRM_HZ) ** 2))


def _with_gyration(calibration: CrossSpectrumCalibration, log_s: float) -> CrossSpectrumCalibration:
    parameters = calibration.parameters.copy()
    parameters[_GYRATION] = log_s
    return replace(calibration, parameters=parameters)


def _as_shaped(calibration: CrossSpectrumCalibration, shape: Shaped | None) -> CrossSpectrumCalibration:
    return calibration if shape is None else _with_gyration(calibration, shape.log_s)


def _located(
    whittle: Whittle,
    peak: _Peak,
    shape: Shaped | None,
    calibration: CrossSpectrumCalibration,
    cg_left_m: float,
    evidence: float,
) -> Located:
    calibration = _as_shaped(calibration, shape)
    prior = peak.packing
    x = peak.found.x if shape is None else np.r_[shape.x[:-2], shape.load]
    point = _point(x, calibration, cg_left_m)
    at = answer_at(whittle, point, calibration, prior, evidence, is_shape_known=shape is None)
    if shape is None:
        x = x + np.r_[np.zeros(len(DRIFTING)), at.shift[-2:]]
        point = _point(x, calibration, cg_left_m)
    found = at.covariance
    day = day_columns(at.marginal, at.steady, prior.precision)
    moved_by_gain = gain_moves(at.whole, whittle, point, found)
    columns = {
        Source.DAY: day[:, -2:],
        Source.LOAD_LENGTH: packing_columns(at.marginal, prior.precision)[:, -2:],
    }
    if shape is not None:
        columns |= _of_shape(shape, columns[Source.LOAD_LENGTH])
    likeliest = (float(calibration.parameters[_GYRATION]), peak.found.x) if shape is None else shape.likeliest
    fitted = _with_gyration(calibration, likeliest[0])
    at_peak = _point(likeliest[1], fitted, cg_left_m)
    misfit = whittle.misfit(at_peak)
    judged = whittle.curvature(at_peak, [*range(len(PARAMETERS)), len(point.theta), len(point.theta) + 1])
    parameters = fitted.parameters.copy()
    parameters[DRIFTING] = prior.drifting
    own = found[-2:, -2:] + at.own[-2:, -2:]
    rivalled = own + sum((each.T @ each for each in columns.values()), np.zeros((2, 2)))
    return Located(
        point=point,
        own=own,
        moves=at.moves,
        columns=columns,
        drifted=day[:, :-2],
        tails=NORMAL_TAILS if shape is None else shape.tails,
        gain_moves=moved_by_gain[-2:],
        rival_covariance=peak.rivals,
        misfit=misfit,
        tension=min(
            tension_of(likeliest[1][:-2] - one.drifting, is_worn=prior.is_worn)
            for one in packings(calibration.parameters, prior.precision)
        ),
        freed=dampers_of((x[:-2] if peak.freed is None else peak.freed) - prior.drifting),
        scores=scores_of(judged, at_peak, found, replace(fitted, parameters=parameters), prior.precision),
        soft_mass=soft_mass_of(whittle, at_peak, calibration, prior),
        is_reversed=_is_reversed(whittle, at_peak, misfit, fitted),
        as_known=_point(peak.found.x, calibration, cg_left_m).load,
        is_converged=peak.found.is_converged if shape is None else shape.is_converged,
        is_ambiguous=bool(np.any(np.diag(peak.rivals) > MOST_RIVALRY * np.diag(rivalled))),
    )


def _of_shape(shape: Shaped, packing: F64) -> dict[Source, F64]:
    """Columns of the shape's uncertainty: the part common to this vehicle's loads, and this load's own part.

    Errors of a Gaussian posterior are (1 - K) times those of its prior, K being its gain, plus those of the evidence;
    only of the former the habit's part is common.
    """
    goods = shape.column * np.sqrt(shape.goods_part)
    own = shape.column * np.sqrt(1.0 - shape.goods_part)
    return {Source.GOODS: goods[None], Source.LOAD_LENGTH: np.vstack([own, packing])}


def _is_reversed(whittle: Whittle, point: Point, misfit: float, calibration: CrossSpectrumCalibration) -> bool:
    """True if the pitch rate fits better with the other sign: at this load or, if this fits badly, at any start.

    Spectra with the wrong sign may lead the search to a load where neither sign fits.
    """
    reverse = whittle.showing(whittle.spectra.with_pitch_reversed())
    least = reverse.cost(point)
    if not misfit <= calibration.misfit_limit:
        usual, loads = calibration.parameters[DRIFTING], _starting_loads(calibration)
        starts = [_point(np.r_[usual, load], calibration, point.cg_left_m) for load in loads]
        least = min(least, float(reverse.costs(starts).min()))
    return least < whittle.cost(point)


def _point(x: F64, calibration: CrossSpectrumCalibration, cg_left_m: float) -> Point:
    """The point of drifting parameters, payload and front share."""
    theta = calibration.parameters.copy()
    theta[DRIFTING] = x[:-2]
    return Point(theta, float(x[-2]), float(x[-1]), cg_left_m)


def _moving(spectra: CrossSpectra, x: F64, calibration: CrossSpectrumCalibration) -> CrossSpectra:
    """The spectra with the stroke speeds of the calibrated vehicle under the load at x."""
    load = _point(x, calibration, 0.0).load
    return with_strokes(spectra, calibration.parameters, load, calibration.ground)


def _best(spectra: CrossSpectra, calibration: CrossSpectrumCalibration, precision: F64) -> tuple[Whittle, _Peak]:
    """The likelihood and the best of the peaks reached from a few starting loads, firm and soft, with the covariance of
    its competitors.
    """
    whittle = Whittle(spectra, calibration.ground)
    peaks = []
    for packing, n in zip(packings(calibration.parameters, precision), (STARTS_TRIED, 1), strict=True):
        starts = [np.r_[packing.drifting, load] for load in _starting_loads(calibration)]
        costs = whittle.costs([_point(x, calibration, 0.0) for x in starts])
        tried = [starts[i] for i in np.argsort(costs, kind="stable")[:n].tolist()]
        peaks += [_Peak(_search(whittle, one, packing, calibration, 0.0, COARSE), packing) for one in tried]
    best = min(peaks, key=_rank)
    freed = None
    if strain_of(best.found.x[:-2] - best.packing.drifting) > LEAST_STRAIN:
        packing = worn(best.packing)
        peaks.append(_Peak(_search(whittle, best.found.x, packing, calibration, 0.0, COARSE), packing))
        freed = peaks[-1].found.x[:-2]
        best = min(peaks, key=_rank)
    whittle = Whittle(_moving(spectra, best.found.x, calibration), calibration.ground)
    found = _search(whittle, best.found.x, best.packing, calibration, 0.0)
    return whittle, _Peak(found, best.packing, _rivalry(found, peaks), freed)


def _rank(peak: _Peak) -> float:
    """The cost by which a peak competes to be the answer."""
    return peak.found.cost + peak.packing.decisive


def _rivalry(found: Found, peaks: Sequence[_Peak]) -> F64:
    """(2, 2) covariance about the best peak from other peaks, weighted by their probability.

    A batch repeats one error of the model, so its evidence counts as little as in calibration.
    """
    away = np.array([peak.found.x[-2:] - found.x[-2:] for peak in peaks])
    costs = np.array([peak.found.cost + peak.packing.cost for peak in peaks])
    weights = np.exp(-EVIDENCE_WEIGHT * (costs - costs.min()))
    spread: F64 = (away.T * (weights / weights.sum())) @ away
    return spread


def _search(
    whittle: Whittle,
    start: F64,
    packing: Packing,
    calibration: CrossSpectrumCalibration,
    cg_left_m: float,
    tolerance: float = FINE,
) -> Found:
    """Drift parameters, then payload (kg) and front share (0..1), of the peak reached from ``start``."""
    prior_mean = np.r_[packing.drifting, 0.0, 0.0]
    prior_precision = _flat_in_load(packing.precision)
    most_kg = MOST_LOAD_SHARE * calibration.empty_mass_kg

    def cost(x: F64) -> float:
        return whittle.cost(_point(x, calibration, cg_left_m)) if abs(x[-2]) <= most_kg else np.inf

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
