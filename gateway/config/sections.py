"""Tables of springscale.toml about what a service keeps on its disk, and how it is calibrated and verified there."""

from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Seconds = Annotated[float, Field(gt=0.0, le=1e9, allow_inf_nan=False)]  # 32 years: fits 64 bits in nanoseconds
LimitKg = Annotated[float | None, Field(gt=0.0, le=100_000.0, allow_inf_nan=False)]  # road vehicles weigh less
OF_CALIBRATION = "[default: as the calibration has it]"


class SettingsSection(BaseModel):
    """A table of the file."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class KeepSection(SettingsSection):
    """The batches kept for later calibrations, which then need no logs."""

    batches: int = Field(256, ge=0, le=100_000, description="batches kept at most, the newest (0: none)")
    size_mb: float = Field(128.0, ge=1.0, le=100_000.0, description="disk space for them; the oldest are removed")


class RecordSection(SettingsSection):
    """The ring log: the mapped frames themselves, kept on disk as long as there is room."""

    enabled: bool = Field(False, description="whether frames are recorded")
    directory: Path | None = Field(None, description="folder of the segments [default: `record` in that of the store]")
    max_size_mb: float = Field(1024.0, ge=16.0, le=1e9, description="the oldest segments are removed beyond this size")
    max_daily_mb: float = Field(512.0, gt=0.0, le=1e9, description="no more than this is written in a day (UTC)")
    free_mb: float = Field(256.0, ge=0.0, le=1e9, description="with less free space on the disk nothing is recorded")
    block_s: float = Field(
        120.0, ge=1.0, le=3600.0, description="frames are written together so often; a power cut costs as much"
    )


class VerificationSection(SettingsSection):
    """Requirements of a verification with known loads, and how often it is due: choose what your law or your customer
    requires.
    """

    permitted_error_pct: float = Field(
        5.0, gt=0.0, le=100.0, description="largest error of the gross weight, in percent of the known one"
    )
    permitted_axle_error_pct: float | None = Field(
        None, gt=0.0, le=100.0, description="the same for each axle's [default: axles are reported and not judged]"
    )
    loads: int = Field(1, ge=1, le=10, description="least number of known loads for a record to pass")
    every_days: float = Field(0.0, ge=0.0, le=36_500.0, description="due so long after the last that passed (0: never)")


class CommissioningSection(SettingsSection):
    """Calibrating on the vehicle itself, from an empty drive."""

    is_allowed: bool = Field(True, description="whether users with scope operate may make a calibration here")
    lines: Path | None = Field(None, description="folder with calibrations of sister vehicles and line files to choose")
    goal_pct: float = Field(
        4.5,
        ge=0.5,
        le=50.0,
        description="the drive is sufficient when the standard deviation of a payload is this share of the largest "
        "payload",
    )
    memory_mb: float = Field(
        768.0, ge=256.0, le=16_384.0, description="address space of the process that fits, which takes far less memory"
    )
    is_unsigned_believed: bool = Field(
        False,
        description="if [trust] requires signatures: accept calibrations made here, which nobody signs",
    )


class PositionSection(SettingsSection):
    """The vehicle's positions that are kept, and whether they may leave the vehicle."""

    decimals: int | None = Field(
        None,
        ge=0,
        le=7,
        description="decimals of a degree kept: 2 is about 1 km, 4 about 10 m [default: no positions are kept]",
    )
    forward: bool = Field(False, description="forward kept positions to the broker of [uplink] too")
