"""Theoretical limits of the accuracy: the paper's van on the paper's road, by observation and prior knowledge."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import radians
from types import MappingProxyType
from typing import Final

from benchmarks.accuracy.sensor_bounds import SPEED, Bound, Scene, Seen, bound_of
from gateway.calibration.half_car import prior_of
from gateway.calibration.half_car.known_spectra import BAND_HZ, N_SEGMENT
from gateway.core.cross_spectrum.ideal_drive import Drive
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.model.parameters import Ground
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.vehicle import Vehicle
from gateway.units import STANDARD_GRAVITY_MPS2
from gateway.workbench.campaigns import PAPER_PAYLOAD_KG, PAPER_ROUGHNESS_M3, PAPER_SPEED_MPS, PAPER_WHEELBASE_M

PAPER_VAN: Final = Vehicle(
    name="paper_van",
    empty_mass_kg=1240.0,
    wheelbase_m=PAPER_WHEELBASE_M,
    empty_front_share_pct=50.0,
    sensor_position_m=3.1,
)
MODEL_SLACK: Final = 0.02  # chosen: share of unmodelled power
SENSOR_NOISE: Final = (
    (150e-6 * STANDARD_GRAVITY_MPS2) ** 2,
    radians(0.01) ** 2,
)  # per hertz, usual for automotive MEMS
SHARE_RANGE_PCT: Final = 20.0  # the paper's range of front shares
MILD: Final[Mapping[str, float]] = MappingProxyType(
    {
        "spring_front_npm": 0.1,
        "spring_rear_npm": 0.1,
        "damper_front_nspm": 0.2,
        "damper_rear_nspm": 0.2,
        "tyre_front_npm": 0.1,
        "tyre_rear_npm": 0.1,
        SPEED: 0.01,
    }
)


@dataclass(frozen=True, slots=True)
class Limit:
    """One row: the observation, whether the vehicle is known, the disturbance, and the bound."""

    seen: Seen
    is_vehicle_known: bool
    disturbance: str
    bound: Bound

    @property
    def payload_pct(self) -> float:
        """In percent of the paper's range, 450 kg."""
        return 100.0 * self.bound.payload_std_kg / PAPER_PAYLOAD_KG

    @property
    def front_share_pct(self) -> float:
        """In percent of the paper's range, 20 points."""
        return 100.0 * self.bound.front_share_std_pct / SHARE_RANGE_PCT


def limits(drive: Drive | None = None) -> list[Limit]:
    """Bounds at half the rated payload, 50 % in front; by default 300 s at 50 km/h."""
    driven = drive or Drive(300.0, PAPER_SPEED_MPS)
    ground = Ground.of(PAPER_VAN)
    point = Point(prior_of(PAPER_VAN).mean, PAPER_PAYLOAD_KG / 2.0, 0.5)
    reading = Reading(PAPER_VAN.wheelbase_m, BAND_HZ, N_SEGMENT)
    scenes = {
        f"{100.0 * MODEL_SLACK:g} % slack": Scene(point, ground, reading, driven, PAPER_ROUGHNESS_M3, MODEL_SLACK),
        "sensor noise": Scene(point, ground, reading, driven, PAPER_ROUGHNESS_M3, 0.0, *SENSOR_NOISE),
    }
    return [
        Limit(seen, not unknown, name, bound_of(seen, unknown, scene))
        for unknown in ({}, MILD)
        for seen in Seen
        for name, scene in scenes.items()
    ]


def limits_table(found: list[Limit]) -> str:
    """The table in Markdown."""
    lines = ["| seen | vehicle | beside the road | payload | front share |", "|---|---|---|---|---|"]
    for one in found:
        known = "known" if one.is_vehicle_known else "mild priors"
        lines.append(
            f"| {one.seen} | {known} | {one.disturbance} | {one.bound.payload_std_kg:.2f} kg, {one.payload_pct:.2f} % "
            f"| {one.bound.front_share_std_pct:.3f} pp, {one.front_share_pct:.2f} % |"
        )
    return "\n".join(lines) + "\n"
