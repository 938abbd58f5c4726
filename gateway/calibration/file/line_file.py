"""The line file: the output of ``springscale line build`` from several calibration files, and the input of
``--like``.
"""

import json
from pathlib import Path
from typing import Final, Literal

from pydantic import Field, ValidationError

from gateway.calibration.file.calibration_file import (
    CalibrationFile,
    content_id,
    load_calibration,
    matches_its_id,
    read_content,
)
from gateway.calibration.file.parts import ExpectedErrorsPart, LinePart
from gateway.errors import CalibrationFileError
from gateway.files.signed import Read
from gateway.stated.facts import Part
from gateway.toml_file import describe_faults

LINE_FORMAT: Final = "springscale-line"
LINE_VERSION: Final = 4  # of the format


class SiblingPart(Part):
    """One of the vehicles of a line."""

    id: str = Field(description="of its calibration file")
    name: str
    empty_mass_kg: float
    n_runs: int


class LineFile(Part):
    """The whole file except its id."""

    format: Literal["springscale-line"] = LINE_FORMAT
    version: Literal[4] = LINE_VERSION
    software: str
    siblings: tuple[SiblingPart, ...] = Field(min_length=1)
    line: LinePart
    expected_errors: ExpectedErrorsPart | None = Field(
        None,
        description="root mean square, of siblings left out in turn, each calibrated by one empty drive of its own "
        "and the others as prior; null: none was left out",
    )
    warnings: tuple[str, ...] = ()

    @property
    def id(self) -> str:
        """sha256 of the canonical JSON of everything in the file but the id itself."""
        return content_id(self.model_dump(mode="json"))

    def to_json(self) -> str:
        """The file's text, id first."""
        return json.dumps({"id": self.id, **self.model_dump(mode="json")}, indent=1, allow_nan=False) + "\n"


LikeFile = CalibrationFile | LineFile


def load_like(path: Path, read: Read = Path.read_bytes) -> LikeFile:
    """A calibration of a sister vehicle, or a line file. Raises CalibrationFileError saying what to do."""
    content = read_content(path, read)
    if content.get("format") != LINE_FORMAT:
        return load_calibration(path, read)
    if content.get("version") != LINE_VERSION:
        raise CalibrationFileError(
            f"{path}: line file version {content.get('version')!r}, this springscale reads version "
            f"{LINE_VERSION}: build it again with `springscale line build`"
        )
    if not matches_its_id(content):
        raise CalibrationFileError(
            f"{path}: content does not match its id: the file was changed after it was written; restore it or build "
            "it again"
        )
    try:
        held = LineFile.model_validate({key: part for key, part in content.items() if key != "id"})
        held.line.require_known()
    except ValidationError as fault:
        raise CalibrationFileError(describe_faults(path, fault, LineFile)) from None
    except CalibrationFileError as fault:
        raise CalibrationFileError(f"{path}: {fault}") from None
    return held
