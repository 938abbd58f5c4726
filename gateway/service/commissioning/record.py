"""commissioning.json: the commissioning under way, and the calibrations made. Replaced atomically."""

import json
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import Field, ValidationError

from gateway.calibration.commissioning.answers import NO_LINE, LineFacts
from gateway.calibration.commissioning.job import Learned
from gateway.calibration.file.parts import Part
from gateway.core.vehicle import Vehicle
from gateway.errors import ConfigurationError
from gateway.files.kept import KeptFiles
from gateway.stated.doubt import OF_THE_DRIVE, Doubt, DoubtKind
from gateway.stated.facts import VehicleAnswers
from gateway.toml_file import describe_faults

FILE_NAME: Final = "commissioning.json"
MADE: Final = "commissioned-"  # the names of calibrations begin so
MOST_MADE: Final = 20  # calibrations; the oldest beyond are forgotten, and their files removed

Source = Literal["package", "administrator", "uploaded"]


class LineChoice(Part):
    """The chosen line. ``copy_name`` is its copy in the service's folder, None without a line.

    ``shared`` gives figures that were not typed, ``facts`` figures to compare typed answers with, ``figures`` those
    that prefill a form.
    """

    name: str
    id: str | None = None
    source: Source | None = None
    copy_name: str | None = None
    shared: dict[str, Any] = Field(default_factory=dict)
    facts: LineFacts = NO_LINE
    figures: dict[str, Any] = Field(default_factory=dict)


class EmptyClaim(Part):
    """Who stated that the vehicle is empty, and the position in the drive then: an open window does not count."""

    at: str
    by: str
    drive_start_ns: int | None
    newest_ns: int | None

    def covers(self, drive_start_ns: int, t_start_ns: int) -> bool:
        """Whether a window lies after the statement."""
        if self.newest_ns is None or drive_start_ns != self.drive_start_ns:
            return True
        return t_start_ns >= self.newest_ns


class Confirmed(Part):
    """Doubts that somebody confirmed: the facts are right."""

    at: str
    by: str
    kinds: tuple[DoubtKind, ...]


class Underway(Part):
    """A commissioning that has begun and not ended."""

    begun_at: str
    by: str
    note: str | None = None
    line: LineChoice | None = None
    vehicle: VehicleAnswers | None = None
    empty: EmptyClaim | None = None
    batches: tuple[str, ...] = Field((), description="kept batches of the empty drive, oldest first")
    open_batch: str | None = Field(None, description="the part so far of the open window")
    signals_id: str = Field(description="of the signal map that they were read with")
    learned: Learned | None = None
    is_fit_asked: bool = False
    fault: str | None = Field(None, description="why the last fit made no calibration")
    doubts: tuple[Doubt, ...] = Field((), description="about typed answers, and about the result of the last fit")
    confirmed: tuple[Confirmed, ...] = ()

    @property
    def open_doubts(self) -> tuple[Doubt, ...]:
        """Unconfirmed doubts."""
        confirmed = {kind for one in self.confirmed for kind in one.kinds}
        return tuple(one for one in self.doubts if one.kind not in confirmed)

    @property
    def is_vehicle_doubted(self) -> bool:
        """Whether a typed answer is still in doubt."""
        return any(one.kind not in OF_THE_DRIVE for one in self.open_doubts)

    def with_doubts_of_drive(self, found: tuple[Doubt, ...]) -> tuple[Doubt, ...]:
        """The doubts about typed answers, with ``found`` in place of those from an earlier fit."""
        return (*(one for one in self.doubts if one.kind not in OF_THE_DRIVE), *found)


class Ended(Part):
    """When, by whom and why a calibration went out of use."""

    at: str
    by: str
    why: Literal["undone", "back_to_factory"]


class MadeCalibration(Part):
    """A calibration that was made here, and what it was made from."""

    id: str = Field(description="of the calibration file")
    file_name: str
    at: str
    by: str
    note: str | None
    line: LineChoice
    vehicle: Vehicle
    batches: tuple[str, ...]
    learned: Learned | None
    warnings: tuple[str, ...]
    ended: Ended | None = None


class CommissioningRecord(Part):
    """The commissioning under way and the calibrations made. Those not ended form a stack; the last is in use."""

    format: Literal["springscale-commissioning"] = "springscale-commissioning"
    version: Literal[1] = 1
    underway: Underway | None = None
    made: tuple[MadeCalibration, ...] = ()

    @property
    def active(self) -> MadeCalibration | None:
        """The calibration to use; None: the one that the settings name."""
        return next((one for one in reversed(self.made) if one.ended is None), None)

    def with_made(self, one: MadeCalibration) -> "CommissioningRecord":
        """The record after a commissioning ended with this calibration."""
        return self.model_copy(update={"underway": None, "made": (*self.made, one)[-MOST_MADE:]})

    def ended(self, chosen: tuple[MadeCalibration, ...], end: Ended) -> "CommissioningRecord":
        """The record with these calibrations ended."""
        made = tuple(one.model_copy(update={"ended": end}) if one in chosen else one for one in self.made)
        return self.model_copy(update={"made": made})


def load_record(directory: Path) -> CommissioningRecord:
    """Empty if there is none yet. Raises ConfigurationError for an invalid file."""
    path = directory / FILE_NAME
    try:
        return CommissioningRecord.model_validate_json(KeptFiles(directory).read(FILE_NAME))
    except FileNotFoundError:
        return CommissioningRecord()
    except OSError as fault:
        raise ConfigurationError(f"{path}: cannot be read: {fault.strerror or fault}") from None
    except ValidationError as fault:
        raise ConfigurationError(describe_faults(path, fault, CommissioningRecord)) from None


def save_record(directory: Path, record: CommissioningRecord) -> None:
    """Write the record; on disk when this returns. Raises OSError, and then the old file stays."""
    text = json.dumps(record.model_dump(mode="json"), indent=1, allow_nan=False, ensure_ascii=False)
    KeptFiles(directory).write(FILE_NAME, (text + "\n").encode())
