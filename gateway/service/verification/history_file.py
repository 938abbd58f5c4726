"""A history in one file: validated when read, set aside if invalid, replaced atomically."""

import logging
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import ValidationError

from gateway.calibration.file.parts import Part
from gateway.files.kept import BrokenFile, KeptFiles
from gateway.log import Event, log_event

H = TypeVar("H", bound=Part)


class HistoryFile(Generic[H]):
    """Not thread-safe. ``fault`` says what happened to an invalid file."""

    def __init__(self, path: Path, empty: H) -> None:
        """Reads the file; ``empty`` is the history if there is no file, and defines its type."""
        self._path = path
        self._files = KeptFiles(path.parent)
        self._broken = BrokenFile(path)
        self.fault: str | None = None
        self.history = self._believed(empty)

    def keep(self, history: H) -> None:
        """Replace the history; on disk when this returns. Raises OSError; then nothing has changed."""
        self._broken.make_way()
        text = history.model_dump_json(indent=1)
        self._files.write(self._path.name, (text + "\n").encode())
        self.history = history
        self.fault = None

    def _believed(self, empty: H) -> H:
        try:
            return type(empty).model_validate_json(self._files.read(self._path.name))
        except FileNotFoundError:
            return empty
        except (OSError, ValidationError) as broken:
            fault = str(broken)
        aside = self._broken.set_aside()
        self.fault = f"{self._path} is invalid, its history starts empty (it {aside})"
        log_event(Event.HISTORY_SET_ASIDE, level=logging.ERROR, file=str(self._path), fault=fault, set_aside=aside)
        return empty
