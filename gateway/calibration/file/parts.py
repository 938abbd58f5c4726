"""The tables that only calibration files have; vehicle and estimators are the core's own records in them."""

from math import isfinite
from typing import Self

from pydantic import Field

from gateway.calibration.found import FoundLoad
from gateway.calibration.statements import Statement
from gateway.stated.facts import Part


class SeenPart(Part):
    """The ranges that the drives covered, and those of its sister: the ranges of validity."""

    payload_kg: tuple[float, float]
    front_share_pct: tuple[float, float]
    speed_mps: tuple[float, float]
    sensor_rate_hz: tuple[float, float] | None = Field(
        description="lower sending rate of accelerometer and gyro; null: not known"
    )
    roughness_mps2: tuple[float, float] | None = Field(
        description="of the roads: vertical acceleration, root mean square from 1 to 15 Hz, scaled to 80 km/h"
    )


class FoundPart(Part):
    """What the fit found of a drive's load, and what the drive says without its statement."""

    payload_kg: float
    payload_std_kg: float
    front_share_pct: float
    without_statement_kg: float | None = Field(description="null: nothing was stated of the payload")
    without_statement_std_kg: float | None
    is_held: bool = Field(description="the statement disagrees beyond chance with its drive, and taught nothing")

    @classmethod
    def of(cls, found: FoundLoad) -> Self:
        """Of a fit's result."""
        is_stated = isfinite(found.without_kg)
        return cls(
            payload_kg=found.load.payload_kg,
            payload_std_kg=found.payload_std_kg,
            front_share_pct=found.load.front_share_pct,
            without_statement_kg=found.without_kg if is_stated else None,
            without_statement_std_kg=found.without_std_kg if is_stated else None,
            is_held=found.is_held,
        )


class DrivePart(Part):
    """One drive that taught the vehicle: where its numbers come from, what was stated of it, what was found."""

    number: int
    log: str
    sha256: str
    t_start: str | None = Field(None, description="of the piece of the log that was used; null: not known")
    t_end: str | None = None
    n_batches: int
    statement: Statement
    found: FoundPart | None = Field(description="null: cross_spectrum was not fitted to this drive")


class ProvenancePart(Part):
    """Enough to repeat the calibration."""

    software: str
    command: str
    campaign_sha256: str
    drives: tuple[DrivePart, ...]


class ExpectedErrorsPart(Part):
    """Errors on drives left out of the fit, over the identification part (root mean square)."""

    payload_rms_kg: float | None
    front_share_rms_pct: float | None
