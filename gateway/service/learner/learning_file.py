"""learning.json and the calibrations that it names: the statements, the vehicle as stated, and what was learnt."""

import logging
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import ValidationError

from gateway.calibration.file import CalibrationFile, load_calibration
from gateway.calibration.learning.job import LearnResult
from gateway.calibration.learning.spans import standing
from gateway.core.vehicle import Vehicle
from gateway.errors import NOT_STORED, CalibrationFileError, ConfigurationError, RefusedError
from gateway.files.owned import KeptFiles
from gateway.files.toml_file import describe_faults
from gateway.log import Event, OnEvent, tell_event
from gateway.records import iso_utc
from gateway.stated.facts import Part, VehicleAnswers
from gateway.stated.learning import Version
from gateway.stated.statement import StatementRecord

FILE_NAME: Final = "learning.json"
LEARNT: Final = "learnt-"  # the names of calibrations begin so
SISTER: Final = "sister-"
MOST_VERSIONS: Final = (
    50  # chosen: calibrations of some 100 kB; the oldest beyond are forgotten, and their files removed
)
MOST_LADEN: Final = 1000  # chosen: more drives than are kept
MOST_STATEMENTS: Final = 10_000  # chosen: three years of ten a day, in 5 MB


class Act(Part):
    """Who did something, and when."""

    at: str
    by: str


class Said(Part):
    """A statement as it was taken. It is never changed, only confirmed or withdrawn."""

    record: StatementRecord
    at: str
    confirmed: Act | None = None
    withdrawn: Act | None = None

    @property
    def effective(self) -> StatementRecord:
        """The record as it is learnt from."""
        return self.record if self.confirmed is None else self.record.model_copy(update={"confirmed": True})


class Stated(Part):
    """The vehicle as somebody stated it, by its id then; ``confirmed``: unlikely figures are right."""

    figures: VehicleAnswers
    at: str
    by: str
    confirmed: Act | None = None
    vehicle_id: str | None = None


class Sister(Part):
    """A vehicle of the same model: its calibration, which somebody handed in, is the prior of what is learnt."""

    file_name: str
    id: str
    vehicle: Vehicle
    said: Act


class LearntVersion(Version):
    """A calibration with its file; ``worse`` says why it is not used."""

    file_name: str
    worse: str | None = None


class Laden(Part):
    """A time of which somebody said that the vehicle was not empty, though it looks so."""

    begin_ns: int
    end_ns: int
    said: Act

    @property
    def span(self) -> tuple[int, int]:
        """Begin and end (ns)."""
        return self.begin_ns, self.end_ns


class LearningRecord(Part):
    """Statements in order of arrival, the vehicle, the versions oldest first, and the last fit without
    the text of its calibration, which is a file of its own.

    ``held`` is the version that somebody chose, or ``file`` for that of the settings; None: the newest good one.
    """

    format: Literal["springscale-learning"] = "springscale-learning"
    version: Literal[1] = 1
    said: tuple[Said, ...] = ()
    vehicle: Stated | None = None
    sister: Sister | None = None
    versions: tuple[LearntVersion, ...] = ()
    held: str | None = None
    laden: tuple[Laden, ...] = ()
    last: LearnResult | None = None

    @property
    def active(self) -> LearntVersion | None:
        """The calibration to use; None: the one that the settings name."""
        if self.held is not None:
            return next((one for one in self.versions if one.id == self.held), None)
        return next((one for one in reversed(self.versions) if one.worse is None), None)

    @property
    def records(self) -> list[StatementRecord]:
        """The statements that stand, in an order that does not depend on that of their arrival."""
        return standing(one.effective for one in self.said if one.withdrawn is None)

    def find(self, statement_id: str) -> Said | None:
        """The statement with this id."""
        return next((one for one in self.said if one.record.id == statement_id), None)

    def changing(self, changed: Said) -> "LearningRecord":
        """The record with this statement changed at its place."""
        said = tuple(changed if one.record.id == changed.record.id else one for one in self.said)
        return self.model_copy(update={"said": said})


def load_learning(directory: Path) -> LearningRecord:
    """The record in a directory, an empty one if there is none. Raises ConfigurationError for an invalid one."""
    path = directory / FILE_NAME
    try:
        return LearningRecord.model_validate_json(KeptFiles(directory).read(FILE_NAME))
    except FileNotFoundError:
        return LearningRecord()
    except OSError as fault:
        raise ConfigurationError(f"{path}: cannot be read: {fault.strerror or fault}") from None
    except ValidationError as fault:
        raise ConfigurationError(describe_faults(path, fault, LearningRecord)) from None


class Book:
    """The file and those that it names. A caller that reads and then changes holds ``lock``.

    A change is on disk before it is in ``record``. An invalid file is set aside, and ``fault`` says so.
    """

    def __init__(self, directory: Path, on_event: OnEvent, clock_ns: Callable[[], int]) -> None:
        """Reads the file."""
        self.directory = directory
        self.lock = threading.RLock()
        self.record = LearningRecord()
        self.fault: str | None = None
        self._files = KeptFiles(directory)
        self._is_invalid_file_in_the_way = False
        self._on_event = on_event
        self.clock_ns = clock_ns
        try:
            self.record = load_learning(directory)
        except ConfigurationError as broken:
            self._set_aside(str(broken))

    def save(self, record: LearningRecord) -> None:
        """Replace the record; on disk when this returns. Raises RefusedError if the disk fails; then nothing has
        changed.
        """
        with _refused_if_not_stored(self.directory / FILE_NAME):
            if self._is_invalid_file_in_the_way:
                self._move_invalid_file()
            self._files.write(FILE_NAME, (record.model_dump_json(indent=1) + "\n").encode())
        self.record, self.fault = record, None

    def write_calibration(self, text: str, calibration_id: str) -> str:
        """Write a calibration that was learnt here -> the name of its file, after reading it back.

        Raises OSError, and CalibrationFileError if the file differs from what was learnt.
        """
        name = f"{LEARNT}{calibration_id.removeprefix('sha256:')[:16]}.json"
        self._files.write(name, text.encode())
        if load_calibration(self.directory / name).id != calibration_id:
            raise CalibrationFileError(f"{name}: is not what was learnt")
        return name

    def write_sister(self, content: bytes, held: CalibrationFile, by: str) -> Sister:
        """Write the calibration of a vehicle of the same model. Raises RefusedError if the disk fails."""
        name = f"{SISTER}{held.id.removeprefix('sha256:')[:16]}.json"
        with _refused_if_not_stored(self.directory / name):
            self._files.write(name, content)
        return Sister(file_name=name, id=held.id, vehicle=held.vehicle, said=self.act(by))

    def forget_others(self) -> None:
        """Remove calibrations that the record no longer names. Raises OSError."""
        named = {one.file_name for one in (*self.record.versions, self.record.sister) if one is not None}
        for path in (one for kind in (LEARNT, SISTER) for one in self.directory.glob(f"{kind}*.json")):
            if path.name not in named:
                path.unlink()

    def tell(self, event: Event, fields: Mapping[str, Any], level: int = logging.INFO) -> None:
        """Write an event to the log and to the store."""
        tell_event(event, fields, self._on_event, level)

    def now(self) -> str:
        """The time, as the record writes it."""
        return iso_utc(self.clock_ns())

    def act(self, by: str) -> Act:
        """Somebody does something now."""
        return Act(at=self.now(), by=by)

    def _set_aside(self, fault: str) -> None:
        """Move an invalid file out of the way, instead of overwriting it, and report what became of it."""
        self._is_invalid_file_in_the_way = True
        try:
            aside = f"is set aside as {self._move_invalid_file()}"
        except OSError as refusal:
            aside = f"cannot be set aside: {refusal}"
        self.fault = f"{fault} (it {aside}): statements and calibrations that were learnt here are not in use"
        self.tell(Event.LEARNING_SET_ASIDE, {"fault": fault, "set_aside": aside}, level=logging.ERROR)

    def _move_invalid_file(self) -> str:
        name = self._files.set_aside(FILE_NAME)
        self._is_invalid_file_in_the_way = False
        return name


@contextmanager
def _refused_if_not_stored(path: Path) -> Iterator[None]:
    """Turn a failure of the disk into a refusal that people read."""
    try:
        yield
    except OSError as fault:
        raise RefusedError(NOT_STORED, f"{path} cannot be written, so nothing has changed: {fault}") from None
