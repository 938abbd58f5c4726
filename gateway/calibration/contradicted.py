"""Contradictions between a drive and the stated facts of the vehicle: its weight, its wheelbase, its model, its sensor.

    contradictions(runs, vehicle, model, sister) -> the doubts, none if all agrees

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

from gateway.calibration.as_stated import StatedRun, fitted, stated_runs
from gateway.calibration.prior import Prior
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.late import special
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import unsprung_kg
from gateway.estimates.quantity import Z95
from gateway.model.fit import Gaussian
from gateway.model.table import FRONT, INDEX, REAR, N
from gateway.model.vehicle_model import VehicleModel
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

_AXLES: Final = (FRONT, REAR)
_OF_AXLE: Final = ("spring_{}_npm", "damper_{}_nspm", "damper_mount_{}_npm", "tyre_{}_npm", "unsprung_{}_kg")
_INERTIA, _DELAY, _SENSOR = (INDEX[name] for name in ("pitch_inertia_kgm2", "delay_scale", "sensor_position_m"))
_BUILT: Final = [INDEX[name.format(axle)] for axle in _AXLES for name in _OF_AXLE] + [_INERTIA]


@dataclass(frozen=True, slots=True)
class _Fitted:
    """A fit and the prior that it started from, without roll."""

    prior: Gaussian
    x: F64
    covariance: F64

    def amount(self, directions: F64) -> tuple[F64, F64]:
        """b (k,) of a false fact that moves the parameters along ``directions`` (N, k), and its covariance (k, k)."""
        precision = self.prior.precision
        information = directions.T @ (precision - precision @ self.covariance @ precision) @ directions
        covariance: F64 = np.asarray(np.linalg.inv(information), float)
        return np.asarray(covariance @ directions.T @ self.prior.pull(self.x), float), covariance

    def alone(self, i: int) -> tuple[float, float, float]:
        """Parameter ``i`` from the drive alone, its standard deviation, and its distance from the prior in standard
        deviations of that distance.
        """
        direction = np.eye(N)[:, [i]]
        (off,), ((variance,),) = self.amount(direction)
        before = 1.0 / self.prior.precision[i, i]
        return float(self.prior.mean[i] + off), sqrt(max(variance - before, 0.0)), float(off / sqrt(variance))


def contradictions(
    runs: Sequence[StatedDrive], vehicle: Vehicle, model: VehicleModel, sister: VehicleModel | None = None
) -> tuple[Doubt, ...]:
    """Contradictions between the drives that taught ``model`` and the statements of ``vehicle``, those of the loads
    taken for true. ``sister``: the vehicle from which it inherited. None if no load is stated.
    """
    known = stated_runs(runs, vehicle, model.reading)
    if not known:
        return ()
    whole = Prior.of_sister(sister, vehicle, with_roll=False) if sister else Prior.of_any(vehicle, with_roll=False)
    fit = _fit(known, Gaussian.of(whole.mean, whole.covariance), model.parameters[:N])
    found = []
    found_m, std_m, stds_off = fit.alone(_SENSOR)
    if abs(stds_off) > DOUBTED_STDS:
        numbers = {"found_m": found_m, "within_m": Z95 * std_m, "said_m": vehicle.sensor_position_m}
        found.append(Doubt.of(DoubtKind.DRIVEN_SENSOR, **numbers))
    if abs(fit.alone(_DELAY)[2]) > LOOKED_STDS:
        precision = fit.prior.precision.copy()  # the time between the axles is free: a wrong wheelbase bends much else
        precision[_DELAY, _DELAY] = FREE_SCALE_STD**-2.0
        fit = _fit(known, Gaussian(fit.prior.mean, precision), fit.x)
        found += _wheelbase(fit, vehicle)
    found += _weight(fit, vehicle)
    if sister is not None and not any(one.kind is not DoubtKind.DRIVEN_SENSOR for one in found):
        found += _model(fit)
    return tuple(found)


def _fit(known: Sequence[StatedRun], prior: Gaussian, start: F64) -> _Fitted:
    found = fitted(known, prior, start)
    return _Fitted(prior, found.common, found.covariance)


def _wheelbase(free: _Fitted, vehicle: Vehicle) -> Iterator[Doubt]:
    scale, std = float(free.x[_DELAY]), sqrt(free.covariance[_DELAY, _DELAY])
    if abs(scale) > max(DOUBTED_STDS * std, LEAST_SCALE):
        found_m, said_m = vehicle.wheelbase_m * (1.0 + scale), vehicle.wheelbase_m
        yield Doubt.of(DoubtKind.DRIVEN_WHEELBASE, found_m=found_m, within_m=Z95 * said_m * std, said_m=said_m)


def _weight(fit: _Fitted, vehicle: Vehicle) -> Iterator[Doubt]:
    """Both axles together: a load aboard, wrong or exchanged weights, pounds."""
    directions, share = np.zeros((N, len(_AXLES))), vehicle.empty_front_share
    for column, axle in enumerate(_AXLES):
        directions[[INDEX[name.format(axle)] for name in _OF_AXLE], column] = -1.0
    directions[_INERTIA] = (-share, share - 1.0)
    off, covariance = fit.amount(directions)
    covariance = covariance + STATED_STD**2 * np.eye(len(_AXLES))
    if off @ np.linalg.solve(covariance, off) <= special.chdtri(len(_AXLES), SELDOM):
        return
    unsprung = np.nan_to_num(unsprung_kg(vehicle))  # nobody stated them: the weights are of what is sprung
    numbers = {}
    for axle, sprung_kg, kg, log, variance in zip(
        _AXLES, np.array([share, 1.0 - share]) * vehicle.empty_mass_kg, unsprung, off, np.diag(covariance), strict=True
    ):
        numbers[f"{axle}_kg"] = sprung_kg * exp(log) + kg
        numbers[f"{axle}_95_kg"] = Z95 * sprung_kg * exp(log) * sqrt(variance)
        numbers[f"said_{axle}_kg"] = sprung_kg + kg
    yield Doubt.of(DoubtKind.DRIVEN_WEIGHT, **numbers)


def _model(fit: _Fitted) -> Iterator[Doubt]:
    """Whether it is of its sister's model at all: all figures that such vehicles share, each by itself."""
    off, covariance = fit.amount(np.eye(N)[:, _BUILT])
    if off @ np.linalg.solve(SISTERS_DIFFER * covariance, off) > special.chdtri(len(_BUILT), SELDOM_SISTER):
        yield Doubt.of(DoubtKind.DRIVEN_SISTER)
