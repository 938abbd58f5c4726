"""The available lines of vehicles: files of the package, of the administrator, and uploaded ones."""

import hashlib
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import Final

from gateway.calibration.commissioning.answers import OF_THE_LINE, LineFacts
from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.file.line_file import LikeFile, load_like
from gateway.calibration.line_files import line_of_files
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationFileError, ConfigurationError, LineError, RefusedError
from gateway.files.kept import KeptFiles
from gateway.service.commissioning.record import LineChoice
from gateway.stated.commissioning import LineFoundTold, LineSource

FOLDER: Final = "lines"
MOST_UPLOADED: Final = 20  # chosen: files that anybody with a token may leave on the disk
MOST_BYTES: Final = 1_000_000  # chosen: of a file
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,58}\.json")


class Lines:
    """All available lines."""

    def __init__(self, directory: Path, administrator: Path | None) -> None:
        """``directory`` is the service's folder; uploaded files lie in a folder below it."""
        self._uploaded = directory / FOLDER
        self._folders: tuple[tuple[LineSource, Path | None], ...] = (
            ("package", Path(str(files("gateway"))) / FOLDER),
            ("administrator", administrator),
            ("uploaded", self._uploaded),
        )

    def found(self) -> Iterator[LineFoundTold]:
        """Every file that could be one, by source and name."""
        for source, folder in self._folders:
            for path in sorted(folder.glob("*.json")) if folder is not None and folder.is_dir() else ():
                try:
                    held, _ = self._load(path)
                except ConfigurationError as fault:
                    yield LineFoundTold(name=path.name, source=source, id=None, vehicle=None, fault=str(fault))
                else:
                    yield LineFoundTold(name=path.name, source=source, id=held.id, vehicle=_figures(held), fault=None)

    def choose(self, name: str, source: LineSource) -> tuple[LineChoice, bytes]:
        """The choice and the file's content. Raises RefusedError."""
        path = next((folder / name for one, folder in self._folders if one == source and folder is not None), None)
        if path is None or _NAME.fullmatch(name) is None or not path.is_file():
            raise RefusedError("no_such_line", f"there is no line {name!r} of the {source}")
        try:
            held, content = self._load(path)
        except ConfigurationError as fault:
            raise RefusedError("line_unusable", str(fault)) from None
        copy_name = f"line-{hashlib.sha256(content).hexdigest()[:16]}.json"
        figures = _figures(held)
        shared = {key: figures[key] for key in OF_THE_LINE if figures.get(key) is not None}
        choice = LineChoice(
            name=name,
            id=held.id,
            source=source,
            copy_name=copy_name,
            shared=shared,
            facts=_facts(held),
            figures=_form(held),
        )
        return choice, content

    def upload(self, name: str, content: str) -> None:
        """Keep a file under this name; on disk when this returns. Raises RefusedError."""
        if _NAME.fullmatch(name) is None:
            raise RefusedError(
                "bad_name", f"{name!r}: a line's file is called like van-model.json: letters, digits, dots, dashes"
            )
        written = content.encode()
        if len(written) > MOST_BYTES:
            raise RefusedError("too_large", f"{name} is longer than {MOST_BYTES} bytes")
        kept, fresh = KeptFiles(self._uploaded), f".{name}.looked-at"
        try:
            self._require_place(name, written)
            kept.write(fresh, written)
            self._load(self._uploaded / fresh)
            kept.write(name, written)
        except OSError as fault:
            raise RefusedError("not_stored", f"{name} cannot be kept: {fault}") from None
        except ConfigurationError as fault:
            said = str(fault).replace(str(self._uploaded / fresh), name)
            raise RefusedError("line_unusable", said) from None
        finally:
            with suppress(OSError):
                (self._uploaded / fresh).unlink()

    def _require_place(self, name: str, written: bytes) -> None:
        there = {path.name for path in self._uploaded.glob("*.json")} if self._uploaded.is_dir() else set()
        if name in there and (self._uploaded / name).read_bytes() != written:
            raise RefusedError("name_taken", f"another line was uploaded as {name}: choose another name")
        if name not in there and len(there) >= MOST_UPLOADED:
            raise RefusedError("too_many", f"{MOST_UPLOADED} lines were uploaded already")

    def _load(self, path: Path) -> tuple[LikeFile, bytes]:
        """The file and its content. Raises ConfigurationError."""
        try:
            if path.stat().st_size > MOST_BYTES:
                raise CalibrationFileError(f"{path}: is longer than {MOST_BYTES} bytes")
            content = path.read_bytes()
        except OSError as fault:
            raise CalibrationFileError(f"{path}: cannot be read: {fault}") from None
        held = load_like(path, lambda _: content)
        try:
            line_of_files([held])
        except LineError as fault:
            raise CalibrationFileError(f"{path}: {fault}") from None
        return held, content


def require_alike(directory: Path, line: LineChoice, vehicle: Vehicle) -> None:
    """Raises RefusedError if a vehicle is not of the line, whose copy lies in ``directory``."""
    if line.copy_name is None:
        return
    try:
        line_of_files([load_like(directory / line.copy_name)]).prior_of(vehicle, with_roll=False)
    except (CalibrationFileError, LineError) as fault:
        raise RefusedError("not_of_the_line", str(fault)) from None


def _figures(held: LikeFile) -> dict[str, object]:
    """Figures of a line that can prefill a form."""
    if isinstance(held, CalibrationFile):
        return asdict(held.vehicle)
    most_kg = held.line.seen.payload_seen_kg[1]
    return {
        "name": held.siblings[0].name,
        "wheelbase_m": held.line.wheelbase_m,
        "payload_range_kg": [0.0, most_kg] if most_kg > 0.0 else None,
    }


def _form(held: LikeFile) -> dict[str, object]:
    """Those figures that the vehicles of the line share."""
    common = ("wheelbase_m", "track_width_m", "payload_range_kg", "kerb_front_axle_kg", "kerb_rear_axle_kg")
    return {name: figure for name, figure in _figures(held).items() if name in common and figure is not None}


def _facts(held: LikeFile) -> LineFacts:
    """Figures with which typed answers are compared."""
    if not isinstance(held, CalibrationFile):
        line = held.line
        return LineFacts(sprung_kg=line.empty_mass_kg, wheelbase_m=line.wheelbase_m)
    sister = held.vehicle
    front_kg, rear_kg = sister.kerb_front_axle_kg, sister.kerb_rear_axle_kg
    return LineFacts(
        sprung_kg=sister.empty_mass_kg,
        wheelbase_m=sister.wheelbase_m,
        axles_kg=None if front_kg is None or rear_kg is None else (front_kg, rear_kg),
        track_width_m=sister.track_width_m,
    )
