"""commissioning.json and the files named in it: the commissioning under way, and the calibrations made."""

import logging
import threading
from collections.abc import Callable, Mapping
from enum import StrEnum
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import Field

from gateway.calibration.commissioning.job import Learned
from gateway.calibration.file.calibration_file import load_calibration
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationFileError, RefusedError
from gateway.files.kept import KeptFiles
from gateway.log import Event, OnEvent, log_event, tell_event
from gateway.records import iso_utc
from gateway.service.record_file import RecordFile
from gateway.stated.commissioning import MadeEnd
from gateway.stated.doubt import Doubt, DoubtKind
from gateway.stated.facts import Part, VehicleAnswers

FILE_NAME: Final = "commissioning.json"
MADE: Final = "commissioned-"  # the names of calibrations begin so
MOST_MADE: Final = 20  # chosen: calibrations; the oldest beyond are forgotten, and their files removed


class CommissioningStep(StrEnum):
    """The next step of a commissioning."""

    VEHICLE = "vehicle"
    EMPTY = "empty"
    DRIVE = "drive"
    FIT = "fit"


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
    def step(self) -> CommissioningStep:
        """The first step that is not answered yet."""
        if self.vehicle is None or self.is_vehicle_doubted:
            return CommissioningStep.VEHICLE
        if self.empty is None:
            return CommissioningStep.EMPTY
        return CommissioningStep.FIT if self.is_fit_asked else CommissioningStep.DRIVE

    @property
    def open_doubts(self) -> tuple[Doubt, ...]:
        confirmed = {kind for one in self.confirmed for kind in one.kinds}
        return tuple(one for one in self.doubts if one.kind not in confirmed)

    @property
    def is_vehicle_doubted(self) -> bool:
        """Whether a typed answer is still in doubt."""
        return any(not one.is_of_drive for one in self.open_doubts)

    def with_doubts_of_drive(self, found: tuple[Doubt, ...]) -> tuple[Doubt, ...]:
        """The doubts about typed answers, with ``found`` in place of those from an earlier fit."""
        return (*(one for one in self.doubts if not one.is_of_drive), *found)


class MadeCalibration(Part):
    """A calibration that was made here, and what it was made from."""

    id: str = Field(description="of the calibration file")
    file_name: str
    at: str
    by: str
    note: str | None
    sister: str | None = Field(description="name of the vehicle whose calibration gave the prior; null: none")
    vehicle: Vehicle
    batches: tuple[str, ...]
    learned: Learned | None
    warnings: tuple[str, ...]
    ended: MadeEnd | None = None

    @property
    def vehicle_name(self) -> str:
        return self.vehicle.name

    @property
    def n_batches(self) -> int:
        return len(self.batches)


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

    def ended(self, chosen: tuple[MadeCalibration, ...], end: MadeEnd) -> "CommissioningRecord":
        made = tuple(one.model_copy(update={"ended": end}) if one in chosen else one for one in self.made)
        return self.model_copy(update={"made": made})


class RecordStore(RecordFile[CommissioningRecord]):
    """The file and those that it names. A caller that reads and then changes holds ``lock``."""

    def __init__(self, directory: Path, on_event: OnEvent, clock_ns: Callable[[], int]) -> None:
        self.directory = directory
        self.lock = threading.RLock()
        self._on_event = on_event
        self._clock_ns = clock_ns
        super().__init__(directory / FILE_NAME, CommissioningRecord())

    def keep_underway(self, underway: Underway | None) -> None:
        """Save the commissioning under way. Raises as :meth:`save`."""
        self.save(self.record.model_copy(update={"underway": underway}))

    def save(self, record: CommissioningRecord) -> None:
        """Write the record to disk. Raises RefusedError if the disk fails; then nothing has changed."""
        try:
            self.keep(record)
        except OSError as fault:
            raise RefusedError(
                "not_stored", f"{self.path} cannot be written, so nothing has changed: {fault}"
            ) from None

    def write(self, name: str, content: bytes) -> None:
        try:
            KeptFiles(self.directory).write(name, content)
        except OSError as fault:
            raise RefusedError("not_stored", f"{name} cannot be written: {fault}") from None

    def write_calibration(self, text: str, calibration_id: str) -> str:
        """Write a calibration that was made here -> the name of its file, after reading it back.

        Raises RefusedError, and CalibrationFileError if the file differs from the fit.
        """
        name = f"{MADE}{calibration_id.removeprefix('sha256:')[:16]}.json"
        self.write(name, text.encode())
        if load_calibration(self.directory / name).id != calibration_id:
            raise CalibrationFileError(f"{name}: is not what was fitted")
        return name

    def forget_others(self) -> None:
        """Remove calibrations that the record no longer names. Raises OSError."""
        named = {one.file_name for one in self.record.made}
        for path in self.directory.glob(f"{MADE}*.json"):
            if path.name not in named:
                path.unlink()

    def cannot_store(self, refusal: Exception) -> None:
        """Report that a change made without a request could not be stored; the next change stores it too."""
        self.fault = f"the commissioning cannot be kept: {refusal}"
        log_event(Event.COMMISSIONING_NOT_KEPT, level=logging.WARNING, fault=str(refusal))

    def tell(self, event: Event, fields: Mapping[str, Any], level: int = logging.INFO) -> None:
        """Write an event to the log and to the store."""
        tell_event(event, fields, self._on_event, level)

    def now(self) -> str:
        return iso_utc(self._clock_ns())

    def set_aside(self, fault: str, aside: str) -> None:
        self.fault = f"{fault} (it {aside}): calibrations made on the vehicle are not in use"
        self.tell(Event.COMMISSIONING_SET_ASIDE, {"fault": fault, "set_aside": aside}, level=logging.ERROR)
