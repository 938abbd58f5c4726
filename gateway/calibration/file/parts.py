"""The tables that only calibration files have; vehicle and estimators are the core's own records in them."""

from pydantic import Field

from gateway.stated.facts import Part


class SeenPart(Part):
    """The ranges that the identification runs covered, and those of its sister: the ranges of validity."""

    payload_kg: tuple[float, float]
    front_share_pct: tuple[float, float]
    speed_mps: tuple[float, float]
    sensor_rate_hz: tuple[float, float] | None = Field(
        description="lower sending rate of accelerometer and gyro; null: not known"
    )
    roughness_mps2: tuple[float, float] | None = Field(
        description="of the roads: vertical acceleration, root mean square from 1 to 15 Hz, scaled to 80 km/h"
    )


class RunPart(Part):
    """One known-load drive: the source of its numbers."""

    number: int
    log: str
    sha256: str
    payload_kg: float
    front_share_pct: float
    payload_left_m: float | None = Field(description="left of the vehicle's centre line; null: not noted")
    n_batches: int


class ProvenancePart(Part):
    """Enough to repeat the calibration."""

    software: str
    command: str
    campaign_sha256: str
    runs: tuple[RunPart, ...]


class ExpectedErrorsPart(Part):
    """Errors on runs left out of the fit, over the identification part (root mean square)."""

    payload_rms_kg: float | None
    front_share_rms_pct: float | None
