"""Speed over time: constant, urban, rural, motorway; jerk bounded by construction.

A drive is a chain of legs: ramp to a speed with a bounded acceleration, hold it. The corners of
that chain are rounded by a moving mean of T seconds, so the jerk stays below acceleration / T.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.records import F64

STEP_S: Final = 0.05  # chosen: of a drive's samples
JERK_MPS3: Final = 1.5  # chosen: bound of a calm driver


@dataclass(frozen=True, slots=True)
class Drive:
    """Speed [m/s] and lateral acceleration [m/s2] (n,), every step_s, linear in between."""

    speed_mps: F64
    lateral_mps2: F64
    step_s: float = STEP_S

    @property
    def duration_s(self) -> float:
        return self.step_s * (len(self.speed_mps) - 1)

    @property
    def longitudinal_mps2(self) -> F64:
        return np.gradient(self.speed_mps, self.step_s)

    @property
    def travelled_m(self) -> F64:
        """Distance (n,), the exact integral of the speed."""
        way = np.cumsum((self.speed_mps[1:] + self.speed_mps[:-1]) * (0.5 * self.step_s))
        return np.concatenate(([0.0], way))

    def then(self, other: "Drive") -> "Drive":
        """This drive, then another; the other's first sample replaces this one's last."""
        if abs(other.speed_mps[0] - self.speed_mps[-1]) > 0.2:
            raise ValueError(
                f"a drive that ends at {self.speed_mps[-1]:.1f} m/s cannot go on at {other.speed_mps[0]:.1f} m/s"
            )
        return Drive(
            np.concatenate((self.speed_mps[:-1], other.speed_mps)),
            np.concatenate((self.lateral_mps2[:-1], other.lateral_mps2)),
            self.step_s,
        )

    def part(self, start_s: float, end_s: float) -> "Drive":
        """The piece from start_s to end_s, both rounded to the grid."""
        begin, end = round(start_s / self.step_s), round(end_s / self.step_s)
        return Drive(self.speed_mps[begin : end + 1], self.lateral_mps2[begin : end + 1], self.step_s)


@dataclass(frozen=True, slots=True)
class Leg:
    """Go to speed_mps with acceleration_mps2 (its size), then hold for hold_s."""

    speed_mps: float
    hold_s: float
    acceleration_mps2: float = 1.2


def drive_of(legs: Sequence[Leg], start_mps: float = 0.0) -> Drive:
    """Ramps and holds (at least one), rounded so that the jerk stays below JERK_MPS3."""
    times, speeds = [0.0], [start_mps]
    for leg in legs:
        times.append(times[-1] + abs(leg.speed_mps - speeds[-1]) / leg.acceleration_mps2)
        times.append(times[-1] + leg.hold_s)
        speeds += [leg.speed_mps, leg.speed_mps]
    ramped = np.interp(np.arange(math.ceil(times[-1] / STEP_S) + 1) * STEP_S, times, speeds)
    sharpest = max(leg.acceleration_mps2 for leg in legs)
    rounded = _rounded(ramped, 2.0 * sharpest / JERK_MPS3)
    return Drive(rounded, np.zeros(len(rounded)))


def constant(speed_mps: float, duration_s: float, rng: np.random.Generator, jitter_std_mps: float = 0.3) -> Drive:
    """A driver who holds a speed: slow wandering around it with the given standard deviation."""
    n = math.ceil(duration_s / STEP_S) + 1
    return Drive(np.maximum(speed_mps + jitter_std_mps * _wander(n, 12.0, rng), 0.0), np.zeros(n))


def standstill(duration_s: float) -> Drive:
    n = math.ceil(duration_s / STEP_S) + 1
    return Drive(np.zeros(n), np.zeros(n))


def urban(duration_s: float, rng: np.random.Generator) -> Drive:
    """Stop and go: 20 to 50 km/h, stops of 3 to 40 s. Ends at rest."""
    return _random_drive(duration_s, rng, kmh=(20.0, 50.0), hold_s=(8.0, 50.0), stop_share=0.6, lateral_mps2=0.7)


def rural(duration_s: float, rng: np.random.Generator) -> Drive:
    """Villages and country roads: 45 to 95 km/h, curves, few stops. Ends at rest."""
    return _random_drive(duration_s, rng, kmh=(45.0, 95.0), hold_s=(25.0, 120.0), stop_share=0.12, lateral_mps2=0.9)


def motorway(duration_s: float, rng: np.random.Generator) -> Drive:
    """Long steady stretches: 80 to 125 km/h. Ends at rest."""
    return _random_drive(duration_s, rng, kmh=(80.0, 125.0), hold_s=(60.0, 240.0), stop_share=0.0, lateral_mps2=0.25)


def _random_drive(
    duration_s: float,
    rng: np.random.Generator,
    kmh: tuple[float, float],
    hold_s: tuple[float, float],
    stop_share: float,
    lateral_mps2: float,
) -> Drive:
    """A drive of random legs with wandering speed and curves, from rest to rest, as long as asked."""
    legs: list[Leg] = [Leg(0.0, 3.0)]
    left_s = duration_s - 40.0
    while left_s > 0.0:
        leg = Leg(rng.uniform(*kmh) / 3.6, rng.uniform(*hold_s), rng.uniform(0.7, 1.8))
        stops = rng.random() < stop_share
        pause = [Leg(0.0, rng.uniform(3.0, 40.0), rng.uniform(1.0, 2.2))] if stops else []
        left_s -= sum(part.hold_s + 12.0 for part in (leg, *pause))
        legs += [leg, *pause]
    plan = drive_of([*legs, Leg(0.0, 5.0, 1.5)])
    speed = plan.speed_mps * (1.0 + 0.02 * _wander(len(plan.speed_mps), 10.0, rng))
    in_motion = np.minimum(speed / 8.0, 1.0)
    return Drive(np.maximum(speed, 0.0), lateral_mps2 * in_motion * _wander(len(speed), 4.0, rng))


def _wander(n: int, correlation_s: float, rng: np.random.Generator) -> F64:
    """Smooth noise (n,) of about zero mean and unit variance: white noise through a Gaussian of that width."""
    knots = np.arange(-4.0, n * STEP_S / correlation_s + 5.0)
    strengths = rng.standard_normal(len(knots))
    at = np.arange(n) * STEP_S / correlation_s
    wander = np.zeros(n)
    power = np.zeros(n)
    for knot, strength in zip(knots, strengths, strict=True):
        near = slice(*np.searchsorted(at, (knot - 4.0, knot + 4.0)))
        bump = np.exp(-0.5 * (at[near] - knot) ** 2)
        wander[near] += strength * bump
        power[near] += bump**2
    smooth: F64 = wander / np.sqrt(power)
    return smooth


def _rounded(ramped: F64, window_s: float) -> F64:
    """Moving mean over window_s; each end holds its speed for half of it, so the result is window_s longer."""
    half = max(round(window_s / STEP_S / 2.0), 1)
    padded = np.pad(ramped, 2 * half, mode="edge")
    total = np.cumsum(np.concatenate(([0.0], padded)))
    rounded: F64 = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
    return np.where(rounded < 1e-9, 0.0, rounded)
