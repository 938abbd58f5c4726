"""A record in a JSON file beside the database: validated when read, set aside if invalid, replaced atomically."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import ValidationError

from gateway.errors import ConfigurationError
from gateway.files.owned import BrokenFile, KeptFiles
from gateway.files.toml_file import describe_faults
from gateway.stated.facts import Part

R = TypeVar("R", bound=Part)


def load_record(path: Path, empty: R) -> R:
    """``empty`` if there is no file yet. Raises ConfigurationError for an invalid one."""
    try:
        return type(empty).model_validate_json(KeptFiles(path.parent).read(path.name))
    except FileNotFoundError:
        return empty
    except OSError as fault:
        raise ConfigurationError(f"{path}: cannot be read: {fault.strerror or fault}") from None
    except ValidationError as fault:
        raise ConfigurationError(describe_faults(path, fault, type(empty))) from None


class RecordFile(ABC, Generic[R]):
    """A record that is on disk before it is in ``record``. Not thread-safe.

    ``fault`` says what happened to an invalid file.
    """

    def __init__(self, path: Path, empty: R) -> None:
        """Reads the file; ``empty`` is the record if there is none, and defines its type."""
        self.path = path
        self.fault: str | None = None
        self.record = empty
        self._broken = BrokenFile(path)
        try:
            self.record = load_record(path, empty)
        except ConfigurationError as broken:
            self.set_aside(str(broken), self._broken.set_aside())

    def keep(self, record: R) -> None:
        """Replace the record; on disk when this returns. Raises OSError; then nothing has changed."""
        self._broken.make_way()
        KeptFiles(self.path.parent).write(self.path.name, (record.model_dump_json(indent=1) + "\n").encode())
        self.record = record
        self.fault = None

    @abstractmethod
    def set_aside(self, fault: str, aside: str) -> None:
        """Report an invalid file in ``fault``; ``aside`` says where it is now."""
