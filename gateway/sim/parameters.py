"""Parameters of a vehicle and its load: masses, springs, dampers, tyres, and their positions.

Places are (x behind the front axle, y left of the centre line, height above the ground), in metres.
Rates and forces are those felt at the wheel. Positive travel compresses.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Spring:
    """F = rate e + progression/2 max(e,0)**2 + stops, e the compression beyond the empty vehicle's.

    A stop presses with stop_npm2 times the square of the way beyond its clearance.
    """

    rate_npm: float
    progression_npm2: float = 0.0
    bump_clearance_m: float = 0.07
    rebound_clearance_m: float = 0.07
    stop_npm2: float = 5e6


@dataclass(frozen=True, slots=True)
class Damper:
    """Digressive and asymmetric: rate below the knee velocity, digression times it far above.

    F = c (q v + (1 - q) v_k S(v / v_k)), c the rate of the side, q the digression. Coulomb
    friction is friction_n S(v / friction_slip_mps). S(x) = x / sqrt(1 + x^2).
    """

    compression_nspm: float
    rebound_nspm: float
    digression: float = 1.0
    knee_mps: float = 0.15
    friction_n: float = 0.0
    friction_slip_mps: float = 0.005


@dataclass(frozen=True, slots=True)
class Wheel:
    """Tyre and what moves with it. Imbalance m r [kg m] pushes with m r omega**2; run-out lifts."""

    unsprung_kg: float
    tyre_npm: float
    tyre_nspm: float = 50.0
    radius_m: float = 0.30
    imbalance_kgm: float = 0.0
    runout_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Axle:
    """Two equal corners, track_m apart; the anti-roll bar presses anti_roll_npm per metre of difference."""

    spring: Spring
    damper: Damper
    wheel: Wheel
    track_m: float
    anti_roll_npm: float = 0.0


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A full car. sprung_kg and the inertias (about the centre of gravity) are those of the empty body.

    rated_payload_kg is what it is built to carry; nothing here enforces it.
    """

    name: str
    sprung_kg: float
    pitch_inertia_kgm2: float
    roll_inertia_kgm2: float
    wheelbase_m: float
    cog_position_m: float
    cog_height_m: float
    front: Axle
    rear: Axle
    rated_payload_kg: float
    contact_patch_m: float = 0.15

    @property
    def empty_front_share_pct(self) -> float:
        """Share of the sprung mass on the front axle."""
        return 100.0 * (1.0 - self.cog_position_m / self.wheelbase_m)


@dataclass(frozen=True, slots=True)
class Load:
    """A rigid body on the floor at (position_m, left_m, height_m).

    length_m, width_m and tall_m give its own inertia as of a homogeneous box. resonance_hz finite: it
    stands on an elastic base of its own and moves vertically on it, with damping_ratio.
    """

    mass_kg: float
    position_m: float
    left_m: float = 0.0
    height_m: float = 0.8
    length_m: float = 0.8
    width_m: float = 0.8
    tall_m: float = 0.5
    resonance_hz: float = math.inf
    damping_ratio: float = 0.1

    @property
    def pitch_inertia_kgm2(self) -> float:
        return self.mass_kg * (self.length_m**2 + self.tall_m**2) / 12.0

    @property
    def roll_inertia_kgm2(self) -> float:
        return self.mass_kg * (self.width_m**2 + self.tall_m**2) / 12.0

    @property
    def is_elastic(self) -> bool:
        return math.isfinite(self.resonance_hz)


def payload_kg(loads: tuple[Load, ...]) -> float:
    return sum(load.mass_kg for load in loads)


def front_share_pct(vehicle: Vehicle, loads: tuple[Load, ...]) -> float:
    """Share of the sprung M + L on the front axle: (3), with the vehicle's own empty share."""
    moment = vehicle.sprung_kg * vehicle.cog_position_m + sum(load.mass_kg * load.position_m for load in loads)
    return 100.0 * (1.0 - moment / ((vehicle.sprung_kg + payload_kg(loads)) * vehicle.wheelbase_m))


def payload_left_m(loads: tuple[Load, ...]) -> float:
    """The payload's centre of gravity left of the centre line; 0 without payload."""
    mass_kg = payload_kg(loads)
    return sum(load.mass_kg * load.left_m for load in loads) / mass_kg if mass_kg > 0.0 else 0.0


def cg_left_m(vehicle: Vehicle, loads: tuple[Load, ...]) -> float:
    """The sprung mass's centre of gravity left of the centre line; the empty body's lies on it."""
    return payload_kg(loads) * payload_left_m(loads) / (vehicle.sprung_kg + payload_kg(loads))


def axle_loads_kg(vehicle: Vehicle, loads: tuple[Load, ...]) -> tuple[float, float]:
    """What scales under the front and the rear axle show at rest: moments about the axles, unsprung included."""
    sprung = vehicle.sprung_kg + payload_kg(loads)
    front = sprung * front_share_pct(vehicle, loads) / 100.0
    return front + 2.0 * vehicle.front.wheel.unsprung_kg, sprung - front + 2.0 * vehicle.rear.wheel.unsprung_kg


def load_for_share(vehicle: Vehicle, mass_kg: float, share_pct: float) -> Load:
    """The load of mass_kg so placed that the front share is share_pct, (3) solved for d.

    Raises ValueError for a load of no mass, and where it would have to stand outside the vehicle (0.6 m before
    the front axle to 1.2 m behind the rear one).
    """
    if mass_kg <= 0.0:
        raise ValueError("a load needs a mass to move the front share")
    lever = (vehicle.sprung_kg + mass_kg) * (1.0 - share_pct / 100.0) * vehicle.wheelbase_m
    position = (lever - vehicle.sprung_kg * vehicle.cog_position_m) / mass_kg
    if not -0.6 <= position <= vehicle.wheelbase_m + 1.2:
        raise ValueError(
            f"{mass_kg:g} kg would have to stand {position:.2f} m behind the front axle for a share of {share_pct:g} %"
        )
    return Load(mass_kg, position)
