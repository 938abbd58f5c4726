"""Vehicles that differ: the scatter of vans about their type, and changes from day to day."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.sim.parameters import Axle, Damper, Vehicle


@dataclass(frozen=True, slots=True)
class Scatter:
    """Standard deviations of the logarithm of each property; those of an axle are drawn for each axle separately."""

    spring: float = 0.0
    progression: float = 0.0
    damper: float = 0.0
    friction: float = 0.0
    tyre: float = 0.0
    unsprung: float = 0.0
    sprung: float = 0.0
    wheelbase: float = 0.0
    cog_position: float = 0.0
    inertia: float = 0.0


OF_TYPES: Final = Scatter(
    spring=0.12, progression=0.4, damper=0.15, friction=0.4, tyre=0.1, unsprung=0.1,
    sprung=0.08, wheelbase=0.04, cog_position=0.04, inertia=0.1,
)  # fmt: skip
FROM_DAY_TO_DAY: Final = Scatter(spring=0.015, damper=0.05, tyre=0.05)  # temperature, wear, tyre pressure


def scattered(vehicle: Vehicle, scatter: Scatter, rng: np.random.Generator) -> Vehicle:
    """A vehicle drawn about this one; heavier and longer ones also have more inertia (as mass times length squared).

    Its rated payload is the same share of its sprung mass.
    """
    draw = _Draw(rng)
    heavier, longer, inert = draw(scatter.sprung), draw(scatter.wheelbase), draw(scatter.inertia)
    return replace(
        vehicle,
        sprung_kg=vehicle.sprung_kg * heavier,
        wheelbase_m=vehicle.wheelbase_m * longer,
        cog_position_m=vehicle.cog_position_m * longer * draw(scatter.cog_position),
        pitch_inertia_kgm2=vehicle.pitch_inertia_kgm2 * heavier * longer**2 * inert,
        roll_inertia_kgm2=vehicle.roll_inertia_kgm2 * heavier,
        rated_payload_kg=vehicle.rated_payload_kg * heavier,
        front=_axle(vehicle.front, scatter, heavier, draw),
        rear=_axle(vehicle.rear, scatter, heavier, draw),
    )


class _Draw:
    """Factors whose logarithm is normal with a given standard deviation; each takes one number of the generator."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng

    def __call__(self, log_std: float) -> float:
        return float(np.exp(log_std * self._rng.standard_normal()))


def _axle(axle: Axle, scatter: Scatter, heavier: float, draw: _Draw) -> Axle:
    wheel = axle.wheel
    return replace(
        axle,
        spring=replace(
            axle.spring,
            rate_npm=axle.spring.rate_npm * heavier * draw(scatter.spring),
            progression_npm2=axle.spring.progression_npm2 * draw(scatter.progression),
        ),
        damper=_damper(axle.damper, heavier * draw(scatter.damper), draw(scatter.friction)),
        wheel=replace(
            wheel, tyre_npm=wheel.tyre_npm * draw(scatter.tyre), unsprung_kg=wheel.unsprung_kg * draw(scatter.unsprung)
        ),
    )


def _damper(damper: Damper, stiffer: float, stickier: float) -> Damper:
    return replace(
        damper,
        compression_nspm=damper.compression_nspm * stiffer,
        rebound_nspm=damper.rebound_nspm * stiffer,
        friction_n=damper.friction_n * stickier,
    )
