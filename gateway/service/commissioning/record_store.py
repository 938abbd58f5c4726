"""The store of commissionings: owner of commissioning.json and of the files named in it."""

import logging
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from gateway.calibration.file.calibration_file import load_calibration
from gateway.errors import CalibrationFileError, CommissioningRefusedError, ConfigurationError
from gateway.files.kept import BrokenFile, KeptFiles
from gateway.log import Event, OnEvent, log_event, tell_event
from gateway.records import iso_utc
from gateway.service.commissioning.record import (
    FILE_NAME,
    MADE,
    CommissioningRecord,
    Underway,
    load_record,
    save_record,
)


class RecordStore:
    """Every change is on disk before it is in ``record``. A caller that reads and then changes holds ``lock``."""

    def __init__(self, directory: Path, on_event: OnEvent, clock_ns: Callable[[], int]) -> None:
        """Reads the file; an invalid one is set aside, and ``fault`` says so."""
        self.directory = directory
        self.lock = threading.RLock()
        self.fault: str | None = None
        self._on_event = on_event
        self._clock_ns = clock_ns
        self._broken = BrokenFile(directory / FILE_NAME)
        self.record = self._believed()

    def keep(self, underway: Underway | None) -> None:
        """Save the commissioning under way. Raises as :meth:`save`."""
        self.save(self.record.model_copy(update={"underway": underway}))

    def save(self, record: CommissioningRecord) -> None:
        """Write the record to disk. Raises CommissioningRefusedError if the disk fails; then nothing has changed."""
        try:
            self._broken.make_way()
            save_record(self.directory, record)
        except OSError as fault:
            raise CommissioningRefusedError(
                "not_stored", f"{self.directory / FILE_NAME} cannot be written, so nothing has changed: {fault}"
            ) from None
        self.record = record
        self.fault = None

    def write(self, name: str, content: bytes) -> None:
        """Write a file beside it atomically. Raises CommissioningRefusedError."""
        try:
            KeptFiles(self.directory).write(name, content)
        except OSError as fault:
            raise CommissioningRefusedError("not_stored", f"{name} cannot be written: {fault}") from None

    def write_calibration(self, text: str, calibration_id: str) -> str:
        """Write a calibration that was made here -> the name of its file, after reading it back.

        Raises CommissioningRefusedError, and CalibrationFileError if the file differs from the fit.
        """
        name = f"{MADE}{calibration_id.removeprefix('sha256:')[:16]}.json"
        self.write(name, text.encode())
        if load_calibration(self.directory / name).id != calibration_id:
            raise CalibrationFileError(f"{name}: is not what was fitted")
        return name

    def forget_others(self) -> None:
        """Remove calibrations and copies of lines that the record no longer names. Raises OSError."""
        named = {one.file_name for one in self.record.made} | {one.line.copy_name for one in self.record.made}
        if self.record.underway is not None and self.record.underway.line is not None:
            named.add(self.record.underway.line.copy_name)
        for path in (*self.directory.glob(f"{MADE}*.json"), *self.directory.glob("line-*.json")):
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
        """The present time, RFC 3339."""
        return iso_utc(self._clock_ns())

    def _believed(self) -> CommissioningRecord:
        try:
            return load_record(self.directory)
        except ConfigurationError as broken:
            fault = str(broken)
        aside = self._broken.set_aside()
        self.fault = f"{fault} (it {aside}): calibrations made on the vehicle are not in use"
        self.tell(Event.COMMISSIONING_SET_ASIDE, {"fault": fault, "set_aside": aside}, level=logging.ERROR)
        return CommissioningRecord()
