"""A known vehicle of the model's parameters, its drives, and what known loads teach of it."""

from dataclasses import replace

import numpy as np
import pytest

from gateway.calibration.stated_drive import StatedDrive
from gateway.calibration.statements import Statement
from gateway.calibration.teach import teach
from gateway.core.cargo import known_shape
from gateway.core.vehicle import Load, Vehicle
from gateway.estimates.batch_estimate import Estimate
from gateway.model.car import Ground
from gateway.model.spectra import CrossSpectra, cross_spectra_of
from gateway.model.table import ROWS, covariance_of
from gateway.model.vehicle_model import VehicleModel
from gateway.model.weigh import Weighed, by_cross_spectrum, weigh
from gateway.records import F64, Batch, Why
from gateway.stated.statement import StatementSource
from support.kept import kept
from support.model_road import HALF_UNITS, KNOWN, VAN, batch_over_road, model_of, theta_of

FLAT_VAN = replace(VAN, track_width_m=None, sensor_offset_left_std_m=1e-3)
"""A vehicle of which nobody stated a width: its roll rate is not used."""
USUAL_SLACK = 0.03
ROLL = pytest.mark.parametrize("with_roll", [False, True], ids=["two sensors", "three sensors"])
UNITS = {
    **HALF_UNITS,
    "driveline_front_kg": 5.0,
    "driveline_rear_kg": 10.0,
    "roll_inertia_kgm2": 480.0,
    "payload_roll_gyration_m2": 0.12,
    "anti_roll_front_npm": 24e3,
    "anti_roll_rear_npm": 9e3,
    "damper_against_front": 0.9,
    "damper_against_rear": 1.1,
    "sensor_left_m": 0.3,
    "gyro_yaw_rad": 0.02,
    "empty_left_m": 0.01,
}
"""No two axles or sides alike."""


def lost(reason: str) -> pytest.MarkDecorator:
    """A behaviour that the vehicle ought to have."""
    return pytest.mark.xfail(strict=True, reason=reason)


def car(*, with_roll: bool = False, **changed: float) -> F64:
    """The vehicle's vector, with these parameters in the units that end their names."""
    return theta_of(with_roll=with_roll, **(UNITS | changed))


def left_of(payload_kg: float, left_m: float = 0.0) -> float:
    """The centre of gravity left of the centre line, with the payload there."""
    empty_kg = VAN.empty_mass_kg
    return (empty_kg * UNITS["empty_left_m"] + payload_kg * left_m) / (empty_kg + payload_kg)


def drive_of(
    load: tuple[float, float], seed: int, *, with_roll: bool = False, theta: F64 | None = None, **road: float
) -> Batch:
    """A drive with payload (kg) and front share (%), with the slack that the table expects.

    The payload stands on the centre line unless ``road`` says else.
    """
    theta = car(with_roll=with_roll) if theta is None else theta
    batch = batch_over_road(theta, Load(*load), seed, **({"cg_left_m": left_of(load[0]), "slack": USUAL_SLACK} | road))
    return batch if with_roll else replace(batch, roll_rate_radps=None)


def stated(payload_kg: float, share_pct: float, plus_minus_kg: float = 4.0) -> Statement:
    """A weighed load in a known place on the centre line, as compact as the others."""
    return Statement(
        source=StatementSource.KNOWN,
        payload_kg=payload_kg,
        payload_plus_minus_kg=plus_minus_kg,
        front_share_pct=share_pct,
        left_m=0.0,
        is_compact=True,
    )


def known_drives(*, with_roll: bool = False, **road: float) -> list[StatedDrive]:
    """One for each of KNOWN."""
    return [
        StatedDrive(f"drive {i}", (drive_of(load, 10 * i, with_roll=with_roll, **road),), stated(*load))
        for i, load in enumerate(KNOWN)
    ]


@kept
def taught(*, with_roll: bool = False, slack: float = USUAL_SLACK) -> VehicleModel:
    """A vehicle taught by the known loads."""
    return teach(known_drives(with_roll=with_roll, slack=slack), VAN if with_roll else FLAT_VAN).model


def as_if_taught(theta: F64, vehicle: Vehicle = VAN) -> VehicleModel:
    """A fitted vehicle with these parameters, all as sure as vehicles of one line are alike."""
    rows = ROWS[: len(theta)]
    covariance = 0.01 * covariance_of(rows, "line") + 1e-10 * np.eye(len(rows))
    return replace(
        model_of(theta, covariance, tuple(Load(kg, share) for kg in (0.0, 500.0) for share in (38.0, 62.0)), vehicle),
        model_std=(5.0, 0.1, 0.005),
        misfit_limit=100.0,
        acceleration_rms_mps2=0.6,
        pitch_rate_rms_radps=0.03,
        speed_seen_mps=(10.0, 20.0),
        sensor_left_m=vehicle.sensor_left_m,
        sensor_left_std_m=vehicle.sensor_left_std_m,
        least_slack=Ground.of(vehicle, with_roll=len(theta) > len(rows)).least_slack,
    )


def spectra_of(batch: Batch, model: VehicleModel) -> CrossSpectra:
    """The spectra as this vehicle reads them."""
    found = cross_spectra_of([batch], model.reading)
    assert found is not None
    return found


def weighed(batch: Batch, model: VehicleModel) -> Weighed:
    """A load of the known shape, however badly it fits."""
    with np.errstate(all="ignore"):  # as the estimator does
        found = weigh(batch, model, known_shape(*model.known_shape))
    assert not isinstance(found, Why), found
    return found


def estimated(batch: Batch, model: VehicleModel) -> Estimate:
    """A load of the known shape, or why it is refused."""
    blank = Estimate(batch.t_start_ns, batch.t_end_ns, "cross_spectrum")
    with np.errstate(all="ignore"):
        return by_cross_spectrum(batch, model, known_shape(*model.known_shape), blank)
