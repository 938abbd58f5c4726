"""Differences from the calibration, each drawn from the distribution that the estimator states."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import exp

import numpy as np

from benchmarks.accuracy.drives import Trip
from gateway.calibration.known_run import KnownRun
from gateway.core.cargo import ShapePrior
from gateway.core.cross_spectrum.drift import NATURE_STD, NATURE_TOGETHER_STD, kind_of
from gateway.core.cross_spectrum.lateral import PAYLOAD_LEFT_PER_TRACK
from gateway.core.cross_spectrum.sensor_change import GAIN_PER_K, OFFSET_PER_K_MPS2, TEMPERATURE_STD_K
from gateway.core.vehicle import Vehicle as StatedVehicle
from gateway.records import Motion, Signal
from gateway.sim.vehicle import Axle, Damper, Load, Vehicle

USUAL_STROKE_MPS = 0.09
"""Standard deviation of a suspension's stroke speed on the study's calibration drives: 0.08 to 0.10 for its vans."""


def drawn_day(rng: np.random.Generator) -> dict[str, float]:
    """Logarithms of springs, tyres and dampers relative to calibration, and changes of the dampers' friction shares, by
    the names of parameters.
    """
    common = {kind: std * rng.standard_normal() for kind, std in NATURE_TOGETHER_STD.items()}
    own = {name: std * rng.standard_normal() for name, std in NATURE_STD.items()}
    return {name: x + common[kind] for name, x in own.items() if (kind := kind_of(name)) in common}


def on_that_day(van: Vehicle, day: Mapping[str, float]) -> Vehicle:
    """The same van with its springs, tyres, dampers and their friction changed."""
    return replace(van, front=_axle(van.front, day, "front"), rear=_axle(van.rear, day, "rear"))


def _axle(axle: Axle, day: Mapping[str, float], end: str) -> Axle:
    spring, tyre, damper = (
        exp(day[f"{name}_{end}_{unit}"]) for name, unit in (("spring", "npm"), ("tyre", "npm"), ("damper", "nspm"))
    )
    return replace(
        axle,
        spring=replace(
            axle.spring, rate_npm=axle.spring.rate_npm * spring, progression_npm2=axle.spring.progression_npm2 * spring
        ),
        damper=_sticking(axle.damper, damper, day[f"damper_friction_{end}"]),
        wheel=replace(axle.wheel, tyre_npm=axle.wheel.tyre_npm * tyre),
    )


def _sticking(damper: Damper, times: float, share: float) -> Damper:
    """``damper`` with its rate multiplied, and this share of it moved from the oil to friction.

    A friction force F damps like a rate sqrt(2 / pi) F / sigma at the stroke speed sigma.
    """
    rate_nspm = times * 0.5 * (damper.compression_nspm + damper.rebound_nspm)
    friction_n = times * damper.friction_n + share * rate_nspm * USUAL_STROKE_MPS * math.sqrt(math.pi / 2.0)
    return replace(
        damper,
        compression_nspm=damper.compression_nspm * times * (1.0 - share),
        rebound_nspm=damper.rebound_nspm * times * (1.0 - share),
        friction_n=max(friction_n, 0.0),
    )


@dataclass(frozen=True, slots=True)
class Gains:
    """Logarithms of both sensors' gains relative to calibration, and the accelerometer's offset."""

    acceleration: float = 0.0
    rate: float = 0.0
    offset_mps2: float = 0.0


def drawn_gains(rng: np.random.Generator) -> Gains:
    """Gains at another temperature of the sensors, by their data sheets."""
    acceleration, rate, offset = rng.standard_normal(3).tolist()
    gain_std = TEMPERATURE_STD_K * GAIN_PER_K
    return Gains(gain_std * acceleration, gain_std * rate, TEMPERATURE_STD_K * OFFSET_PER_K_MPS2 * offset)


def amplified(rows: Motion, gains: Gains) -> Motion:
    """The same drive through sensors with these gains."""
    columns = rows.columns.copy()
    acceleration = rows.signals.index(Signal.VERTICAL_ACCELERATION)
    columns[:, acceleration] = columns[:, acceleration] * exp(gains.acceleration) + gains.offset_mps2
    for signal in (Signal.PITCH_RATE, Signal.ROLL_RATE):
        if signal in rows.signals:
            columns[:, rows.signals.index(signal)] *= exp(gains.rate)
    return replace(rows, columns=columns)


def drawn_log_s(prior: ShapePrior, rng: np.random.Generator) -> float:
    """A load's squared radius of gyration (logarithm of m2) from the prior of loads."""
    return float(rng.choice(prior.log_s, p=prior.probability))


def load_of_shape(van: Vehicle, mass_kg: float, position_m: float, log_s: float) -> Load:
    """A flat load at the height of the body's centre of gravity, with the length of its radius of gyration."""
    tall_m = 0.1
    length_m = math.sqrt(max(12.0 * exp(log_s) - tall_m**2, 0.0))
    return Load(mass_kg, position_m, height_m=van.cog_height_m, length_m=length_m, tall_m=tall_m)


def exactly_known(log_s: float) -> ShapePrior:
    """The prior of a load whose shape was measured."""
    return ShapePrior(log_s + np.array([-0.01, 0.0, 0.01]), np.array([0.25, 0.5, 0.25]), 0.0)


def place_std_m(vehicle: StatedVehicle) -> float:
    """Standard deviation of a load's lateral place."""
    assert vehicle.track_width_m is not None
    return PAYLOAD_LEFT_PER_TRACK * vehicle.track_width_m


def to_one_side(trip: Trip, left_m: float) -> Trip:
    """The same drive with its load at this distance from the centre line, on either side."""
    return replace(trip, off_m=(abs(left_m), abs(left_m)))


def drawn_share_pct(vehicle: StatedVehicle, rng: np.random.Generator) -> float:
    """Error of the fitter's front share of the empty vehicle, in percentage points."""
    return vehicle.empty_front_share_std_pct * float(rng.standard_normal())


def as_stated(vehicle: StatedVehicle, runs: list[KnownRun], off_pct: float) -> tuple[StatedVehicle, list[KnownRun]]:
    """Vehicle and known loads with this error of the fitter's share; the places of loads are measured correctly."""
    stated = replace(vehicle, empty_front_share_pct=vehicle.empty_front_share_pct + off_pct)

    def placed(run: KnownRun) -> KnownRun:
        part = vehicle.empty_mass_kg / (vehicle.empty_mass_kg + run.payload_kg)
        return replace(run, front_share_pct=run.front_share_pct + off_pct * part)

    return stated, [placed(run) for run in runs]
