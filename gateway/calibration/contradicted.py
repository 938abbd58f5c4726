"""Contradictions between a drive and the stated facts of the vehicle: its weight, its wheelbase, its model, its sensor.

    contradictions(runs, vehicle, calibration, inherited) -> the doubts, none if all agrees

A fit takes the stated facts for true, and bends springs and dampers until the drive fits. Their shift, compared with
its expected size (the prior: of a sister, or of any vehicle), reveals a false fact. With prior N(m, P), posterior N(x,
C) and directions D in which a false fact moves the parameters, the marginal likelihood of the drive is Gaussian in the
amount b of that fact:

    b = H^-1 D' P^-1 (x - m)        H = D' (P^-1 - P^-1 C P^-1) D

with the covariance H^-1; b' H b is chi-squared if the facts are true (S. M. Kay, Fundamentals of Statistical Signal
Processing II, 1998, section 6.4). An axle that carries exp(b) times the stated weight has a spring, damper, tyre and
unsprung mass that all seem exp(b) times too small.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import exp, sqrt
from typing import Final

import numpy as np

from gateway.calibration.half_car.known_spectra import known_spectra
from gateway.calibration.half_car.most_probable_vehicle import fit_half_car
from gateway.calibration.half_car.prior import Inherited, Prior, prior_of
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS, upright
from gateway.core.late import special
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import unsprung_kg
from gateway.estimate import Z95
from gateway.records import F64
from gateway.stated.doubt import Doubt, DoubtKind

SELDOM: Final = 1e-3  # chosen: probability of doubting true weights; a question costs less than a false calibration
SELDOM_SISTER: Final = 1e-4  # chosen: probability of doubting a vehicle that is of its sister's model
SISTERS_DIFFER: Final = 2.0  # chosen: variance within a model over its default
STATED_STD: Final = 0.02  # chosen: of each axle's weight, for fuel, driver, loose items and the scales' step
DOUBTED_STDS: Final = 4.0  # chosen: of a length estimated from the drive
LOOKED_STDS: Final = 3.0  # chosen: of the time between the axles; beyond it the fit is repeated with this time free
FREE_SCALE_STD: Final = 0.1  # chosen: of that time, if the wheelbase is in doubt
LEAST_SCALE: Final = 0.02  # chosen: of a wheelbase; tyres and a receiver's speed explain less

_N: Final = len(PARAMETERS)
_OF_AXLE: Final = ("spring_{}_npm", "damper_{}_nspm", "damper_mount_{}_npm", "tyre_{}_npm", "unsprung_{}_kg")
_AXLES: Final = ("front", "rear")
_BUILT: Final = [INDEX[name.format(axle)] for axle in _AXLES for name in _OF_AXLE] + [INDEX["pitch_inertia_kgm2"]]
_DELAY: Final = INDEX["delay_scale"]
_SENSOR: Final = INDEX["sensor_position_m"]


@dataclass(frozen=True, slots=True)
class _Fitted:
    """A fit and the prior that it started from."""

    prior: Prior
    x: F64
    covariance: F64

    def amount(self, directions: F64) -> tuple[F64, F64]:
        """b (k,) of a false fact that moves the parameters along ``directions`` (p, k), and its covariance (k, k)."""
        precision = self.prior.precision
        information = directions.T @ (precision - precision @ self.covariance @ precision) @ directions
        covariance: F64 = np.asarray(np.linalg.inv(information), float)
        return np.asarray(covariance @ directions.T @ precision @ (self.x - self.prior.mean), float), covariance

    def without_prior(self, i: int) -> tuple[float, float]:
        """Parameter ``i`` from the drive alone, with its standard deviation."""
        before, after = self.prior.covariance[i, i], self.covariance[i, i]
        moved = float(before / max(before - after, 1e-9 * before))
        mean = float(self.prior.mean[i])
        return mean + (float(self.x[i]) - mean) * moved, sqrt(after * moved)

    def stds_off(self, i: int) -> float:
        """Distance of parameter ``i`` from its prior, in standard deviations of that distance."""
        before, after = self.prior.covariance[i, i], self.covariance[i, i]
        return float((self.x[i] - self.prior.mean[i]) / sqrt(max(before - after, 1e-9 * before)))


def contradictions(
    runs: Sequence[KnownRun],
    vehicle: Vehicle,
    calibration: CrossSpectrumCalibration,
    inherited: Inherited | None = None,
) -> tuple[Doubt, ...]:
    """Contradictions between the drives of ``calibration`` and the statements of ``vehicle``."""
    prior = (inherited.prior_of if inherited else prior_of)(vehicle, with_roll=False).upright
    fitted = _Fitted(prior, upright(calibration.parameters), calibration.covariance[:_N, :_N])
    found = list(_sensor(fitted, vehicle))
    if abs(fitted.stds_off(_DELAY)) > LOOKED_STDS:
        fitted = _with_free_wheelbase(runs, vehicle, inherited, fitted)
        found += _wheelbase(fitted, vehicle)
    found += _weight(fitted, vehicle)
    if inherited is not None and not any(one.kind is not DoubtKind.DRIVEN_SENSOR for one in found):
        found += _model(fitted)
    return tuple(found)


def _with_free_wheelbase(
    runs: Sequence[KnownRun], vehicle: Vehicle, inherited: Inherited | None, fitted: _Fitted
) -> _Fitted:
    """The fit again, the time between the axles free: a wrong wheelbase bends much else."""
    precision = fitted.prior.precision.copy()
    precision[_DELAY, _DELAY] = FREE_SCALE_STD**-2.0
    prior = Prior(fitted.prior.mean, precision)
    known = known_spectra(runs, vehicle, with_roll=False, usual=inherited.usual if inherited else None)
    found = fit_half_car(known, prior, fitted.x)
    return _Fitted(prior, found.x, found.covariance)


def _wheelbase(free: _Fitted, vehicle: Vehicle) -> Iterator[Doubt]:
    scale, std = float(free.x[_DELAY]), sqrt(free.covariance[_DELAY, _DELAY])
    if abs(scale) > max(DOUBTED_STDS * std, LEAST_SCALE):
        found_m, said_m = vehicle.wheelbase_m * (1.0 + scale), vehicle.wheelbase_m
        yield Doubt.of(DoubtKind.DRIVEN_WHEELBASE, found_m=found_m, within_m=Z95 * said_m * std, said_m=said_m)


def _sensor(fitted: _Fitted, vehicle: Vehicle) -> Iterator[Doubt]:
    if abs(fitted.stds_off(_SENSOR)) > DOUBTED_STDS:
        found_m, std_m = fitted.without_prior(_SENSOR)
        yield Doubt.of(DoubtKind.DRIVEN_SENSOR, found_m=found_m, within_m=Z95 * std_m, said_m=vehicle.sensor_position_m)


def _weight(fitted: _Fitted, vehicle: Vehicle) -> Iterator[Doubt]:
    """Both axles together: a load aboard, wrong or exchanged weights, pounds."""
    off, covariance = fitted.amount(_axle_directions(vehicle))
    covariance = covariance + STATED_STD**2 * np.eye(len(_AXLES))
    if off @ np.linalg.solve(covariance, off) <= special.chdtri(len(_AXLES), SELDOM):
        return
    shares = (vehicle.empty_front_share, 1.0 - vehicle.empty_front_share)
    unsprung = np.nan_to_num(unsprung_kg(vehicle))  # nobody stated them: the weights are of what is sprung
    said = [share * vehicle.empty_mass_kg + kg for share, kg in zip(shares, unsprung, strict=True)]
    front, rear = (
        (share * vehicle.empty_mass_kg * exp(log) + kg, share * vehicle.empty_mass_kg * exp(log) * sqrt(variance))
        for share, kg, log, variance in zip(shares, unsprung, off, np.diag(covariance), strict=True)
    )
    yield Doubt.of(
        DoubtKind.DRIVEN_WEIGHT,
        front_kg=front[0],
        front_95_kg=Z95 * front[1],
        rear_kg=rear[0],
        rear_95_kg=Z95 * rear[1],
        said_front_kg=said[0],
        said_rear_kg=said[1],
    )


def _axle_directions(vehicle: Vehicle) -> F64:
    """(p, 2) apparent change of the parameters if front and rear axle carry more than was stated."""
    directions = np.zeros((_N, len(_AXLES)))
    for column, axle in enumerate(_AXLES):
        directions[[INDEX[name.format(axle)] for name in _OF_AXLE], column] = -1.0
    directions[INDEX["pitch_inertia_kgm2"]] = (-vehicle.empty_front_share, vehicle.empty_front_share - 1.0)
    return directions


def _model(fitted: _Fitted) -> Iterator[Doubt]:
    """Whether it is of its sister's model at all: all figures that such vehicles share, each by itself."""
    off, covariance = fitted.amount(np.eye(_N)[:, _BUILT])
    if off @ np.linalg.solve(SISTERS_DIFFER * covariance, off) > special.chdtri(len(_BUILT), SELDOM_SISTER):
        yield Doubt.of(DoubtKind.DRIVEN_SISTER)
