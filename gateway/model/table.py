"""The table of parameters: one row says everything that is assumed of a parameter.

A row gives the parameter's scale, its prior for any road vehicle, how much sisters of one line differ in it, and how
much it deviates from day to day, from load to load and from batch to batch. Vectors, priors and covariances of the
model are read from these rows. Standard deviations are of the natural logarithm where the scale is LOG.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from math import log, pi
from typing import Final

import numpy as np

from gateway.core.vehicle import Vehicle
from gateway.records import F64

LOG, LINEAR = "log", "linear"
FRONT, REAR = "front", "rear"
SLACK_KNOTS_HZ: Final = (1.0, 1.5, 2.2, 3.3, 5.0, 7.0, 9.0, 11.0, 13.0, 15.0)
BEND_SHARES: Final = (0.0, 0.2, 0.4, 0.6, 0.9, 1.2)
"""Chosen: the added axle load over half the empty weight at which a spring's rate may bend."""

BEND_STD: Final = 0.25
REFERENCE_KG: Final = 1250.0  # chosen: the vehicle whose tyres, mounts and springs the figures of this table refer to
BOUNCE_HZ: Final = 1.35  # T. D. Gillespie, Fundamentals of Vehicle Dynamics, ch. 5
DAMPING_RATIO: Final = 0.3  # likewise
GYRATION_PER_WHEELBASE: Final = 0.46  # likewise
UNSPRUNG_SHARE: Final = 0.065  # of the empty sprung mass, per axle
GYRATION_PER_TRACK: Final = 0.42  # chosen: radius of gyration in roll
ESTIMATED_UNSPRUNG_STD: Final = 0.3  # chosen: of an unsprung mass that nobody stated
STATED_UNSPRUNG_STD: Final = 0.1  # chosen: of one that the fitter stated

Usual = Callable[[Vehicle], float]
"""The middle of a prior in the unit that ends the parameter's name."""


def scale_of(vehicle: Vehicle) -> float:
    """Its mass in that of the vehicle to which the figures of this table refer."""
    return vehicle.empty_mass_kg / REFERENCE_KG


def _sprung_kg(vehicle: Vehicle, end: str) -> float:
    share = vehicle.empty_front_share
    return vehicle.empty_mass_kg * (share if end == FRONT else 1.0 - share)


def _spring_npm(end: str) -> Usual:
    return lambda vehicle: _sprung_kg(vehicle, end) * (2.0 * pi * BOUNCE_HZ) ** 2 * 1.15  # in series with the tyre


def _damper_nspm(end: str) -> Usual:
    return lambda vehicle: 2.0 * DAMPING_RATIO * (_spring_npm(end)(vehicle) * _sprung_kg(vehicle, end)) ** 0.5


def _stated_unsprung_kg(vehicle: Vehicle, end: str) -> float | None:
    return vehicle.unsprung_front_kg if end == FRONT else vehicle.unsprung_rear_kg


def _unsprung_kg(end: str) -> Usual:
    return lambda vehicle: _stated_unsprung_kg(vehicle, end) or UNSPRUNG_SHARE * vehicle.empty_mass_kg


def _unsprung_std(end: str) -> Usual:
    return lambda vehicle: STATED_UNSPRUNG_STD if _stated_unsprung_kg(vehicle, end) else ESTIMATED_UNSPRUNG_STD


def _track_m(vehicle: Vehicle) -> float:
    if vehicle.track_width_m is None:
        raise ValueError("a vehicle that rolls needs the width of its track")
    return vehicle.track_width_m


@dataclass(frozen=True, slots=True)
class Row:
    """One parameter.

    ``usual`` is the middle of its prior and ``std`` the standard deviation of that. ``line`` is the standard deviation
    among vehicles of one model. ``day``, ``load`` and ``batch`` are those of a drive about its vehicle; ``both_axles``
    is the part of the day's that front and rear axle share, in addition.
    """

    name: str
    scale: str
    usual: float | Usual
    std: float | Usual
    line: float = 0.0
    day: float = 0.0
    both_axles: float = 0.0
    load: float = 0.0
    batch: float = 0.0
    needs_roll: bool = False

    @property
    def kind(self) -> str:
        """The parameter whichever the axle: spring, tyre, damper, damper_friction."""
        return self.name.partition("_front")[0].partition("_rear")[0]

    def prior(self, vehicle: Vehicle) -> tuple[float, float]:
        """Mean and standard deviation as the vector holds the parameter."""
        usual, std = (one(vehicle) if callable(one) else one for one in (self.usual, self.std))
        return (log(usual) if self.scale == LOG else usual), std


def _rows_of_suspension() -> Iterator[Row]:
    """The rows of both axles, in pairs."""
    for end in (FRONT, REAR):
        yield Row(f"spring_{end}_npm", LOG, _spring_npm(end), 0.35, line=0.03, day=0.005, both_axles=0.01)
    for end in (FRONT, REAR):
        yield Row(f"damper_{end}_nspm", LOG, _damper_nspm(end), 0.5, line=0.1, day=0.03, both_axles=0.05)
    for end in (FRONT, REAR):
        yield Row(f"damper_mount_{end}_npm", LOG, lambda v: 500e3 * scale_of(v), 1.0, line=0.15)
    for end in (FRONT, REAR):
        yield Row(f"tyre_{end}_npm", LOG, lambda v: 400e3 * scale_of(v), 0.3, line=0.04, day=0.015, both_axles=0.03)
    for end in (FRONT, REAR):
        yield Row(f"unsprung_{end}_kg", LOG, _unsprung_kg(end), _unsprung_std(end), line=0.03)


def _rows_of_slack(sensor: str, *, needs_roll: bool = False) -> Iterator[Row]:
    """The share of a sensor's power that comes by no modelled path, at each knot."""
    for hz in SLACK_KNOTS_HZ:
        yield Row(f"slack_{sensor}_{hz:g}hz", LOG, 0.03, 1.0, batch=0.3, needs_roll=needs_roll)


def _rows_of_springs_and_friction() -> Iterator[Row]:
    for end in (FRONT, REAR):
        yield Row(
            f"spring_slope_{end}_per_kn", LINEAR, lambda v: 0.03 / scale_of(v), lambda v: 0.05 / scale_of(v), line=0.01
        )
    for end in (FRONT, REAR):
        for i in range(len(BEND_SHARES)):
            yield Row(f"spring_bend_{end}_{i}_per_kn", LINEAR, 0.0, lambda v: BEND_STD / scale_of(v), line=0.01)
    for end in (FRONT, REAR):
        yield Row(f"damper_friction_{end}", LINEAR, 0.1, 0.3, line=0.05, day=0.03, both_axles=0.02)
    for end in (FRONT, REAR):
        yield Row(f"spring_friction_{end}", LINEAR, 0.03, 0.05, line=0.02)
    for end in (FRONT, REAR):
        yield Row(f"damper_digression_{end}", LINEAR, 0.0, 0.1, line=0.05)


def _inertia_kgm2(vehicle: Vehicle) -> float:
    return vehicle.empty_mass_kg * (GYRATION_PER_WHEELBASE * vehicle.wheelbase_m) ** 2


def _roll_inertia_kgm2(vehicle: Vehicle) -> float:
    return vehicle.empty_mass_kg * (GYRATION_PER_TRACK * _track_m(vehicle)) ** 2


ROWS: Final = (
    *_rows_of_suspension(),
    Row("pitch_inertia_kgm2", LOG, _inertia_kgm2, 0.25, line=0.03),
    Row("payload_gyration_m2", LOG, 0.1, 0.7, line=0.3, load=0.5),
    Row("payload_mode_hz", LOG, 25.0, 0.6, line=0.1, load=0.5),
    Row("payload_damping_ratio", LOG, 0.15, 0.5, line=0.3, load=0.5),
    *_rows_of_slack("acceleration"),
    *_rows_of_slack("pitch_rate"),
    Row("noise_acceleration_m2ps3", LOG, 1e-5, 2.0, batch=1.0),
    Row("noise_pitch_rate_rad2ps", LOG, 1e-8, 2.0, batch=1.0),
    Row("track_offset_m", LOG, 0.03, 1.0),
    Row("sensor_position_m", LINEAR, lambda v: v.sensor_position_m, lambda v: v.sensor_position_std_m),
    *_rows_of_springs_and_friction(),
    Row("gyro_lag_s", LINEAR, 0.0, 0.01, batch=0.001),
    Row("delay_scale", LINEAR, 0.0, 0.003, batch=0.003),
    Row("rear_lag_s", LINEAR, 0.0, 0.005, line=0.001),
    Row("driveline_front_kg", LOG, lambda v: 8.0 * scale_of(v), 1.2, batch=0.5),  # the gear
    Row("driveline_rear_kg", LOG, lambda v: 8.0 * scale_of(v), 1.2, batch=0.5),
    Row("accelerometer_gain", LINEAR, 0.0, 1e-6, day=0.0042),
    Row("roll_inertia_kgm2", LOG, _roll_inertia_kgm2, 0.3, line=0.03, needs_roll=True),
    Row("payload_roll_gyration_m2", LOG, 0.15, 0.7, line=0.3, needs_roll=True),
    Row("anti_roll_front_npm", LOG, lambda v: 15e3 * scale_of(v), 1.0, line=0.1, needs_roll=True),
    Row("anti_roll_rear_npm", LOG, lambda v: 7.5e3 * scale_of(v), 1.0, line=0.1, needs_roll=True),
    Row("damper_against_front", LOG, 1.0, 0.3, line=0.1, needs_roll=True),
    Row("damper_against_rear", LOG, 1.0, 0.3, line=0.1, needs_roll=True),
    *_rows_of_slack("roll_rate", needs_roll=True),
    Row("noise_roll_rate_rad2ps", LOG, 1e-8, 2.0, needs_roll=True),
    Row("tracks_apart_m", LOG, _track_m, 0.5, line=0.3, needs_roll=True),
    Row("twist_level", LOG, 1.0, 0.5, line=0.3, needs_roll=True),
    Row("sensor_left_m", LINEAR, lambda v: v.sensor_left_m, lambda v: v.sensor_left_std_m, needs_roll=True),
    Row("gyro_yaw_rad", LINEAR, 0.0, 0.05, needs_roll=True),
    Row("empty_left_m", LINEAR, lambda v: v.empty_cg_left_m, 0.02, needs_roll=True),
)
"""Chosen, all of it, where no source is named; docs/method.md tells why."""

UPRIGHT: Final = tuple(row for row in ROWS if not row.needs_roll)
ROLL: Final = tuple(row for row in ROWS if row.needs_roll)
NAMES: Final = tuple(row.name for row in (*UPRIGHT, *ROLL))
INDEX: Final = {name: i for i, name in enumerate(NAMES)}
N: Final = len(UPRIGHT)


def covariance_of(rows: Iterable[Row], *of: str) -> F64:
    """(k, k) covariance of how a drive deviates from its vehicle: ``of`` names columns of the table (day, load, batch).

    With ``day`` goes the part that both axles share.
    """
    rows = tuple(rows)
    covariance = np.diag([sum(getattr(row, one) ** 2 for one in of) for row in rows])
    if "day" in of:
        for kind in {row.kind for row in rows if row.both_axles}:
            shared = np.array([row.both_axles if row.kind == kind else 0.0 for row in rows])
            covariance = covariance + np.outer(shared, shared)
    return covariance


def prior_of(rows: Iterable[Row], vehicle: Vehicle) -> tuple[F64, F64]:
    """Means and standard deviations (k,) of the rows for any vehicle of this size."""
    mean, std = np.array([row.prior(vehicle) for row in rows]).T
    return mean, std


def prior_of_size(rows: Iterable[Row], empty_mass_kg: float, track_width_m: float) -> F64:
    """Middles (k,) of the priors of rows that depend on a vehicle's mass and track alone."""
    vehicle = Vehicle(
        name="of this size",
        wheelbase_m=2.0 * track_width_m,
        sensor_position_m=0.0,
        track_width_m=track_width_m,
        empty_mass_kg=empty_mass_kg,
    )
    return prior_of(rows, vehicle)[0]


OWN: Final = tuple(i for i, row in enumerate(UPRIGHT) if row.day or row.load or row.batch)
"""The parameters in which every drive deviates from its vehicle."""
N_OWN: Final = len(OWN)


def of_drive(common: F64, deviations: F64) -> F64:
    """(N,) the vehicle of one drive: the vehicle common (N,) to all with the drive's deviations (N_OWN,), or (0,)."""
    theta = common.copy()
    if len(deviations):
        theta[list(OWN)] += deviations
    return theta
