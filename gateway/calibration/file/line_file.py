"""The line file: the output of ``springscale line build`` from several calibration files, and the input of
``--like``.
"""

from pathlib import Path
from typing import ClassVar, Final, Literal

from pydantic import Field

from gateway.calibration.file.calibration_file import CalibrationFile, load_calibration
from gateway.calibration.file.hashed import FileWords, HashedFile, checked_file, read_content
from gateway.calibration.file.parts import ExpectedErrorsPart, LinePart
from gateway.errors import CalibrationFileError
from gateway.stated.facts import Part
from gateway.toml_file import Read

LINE_FORMAT: Final = "springscale-line"
LINE_VERSION: Final = 4  # of the format


class SiblingPart(Part):
    """One of the vehicles of a line."""

    id: str = Field(description="of its calibration file")
    name: str
    empty_mass_kg: float
    n_runs: int


class LineFile(HashedFile):
    """The whole file except its id."""

    words: ClassVar[FileWords] = FileWords("line file", "build it again", "springscale line build")
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


LikeFile = CalibrationFile | LineFile


def load_like(path: Path, read: Read = Path.read_bytes) -> LikeFile:
    """A calibration of a sister vehicle, or a line file. Raises CalibrationFileError saying what to do."""
    content = read_content(path, read)
    if content.get("format") != LINE_FORMAT:
        return load_calibration(path, read)
    held = checked_file(path, content, LineFile)
    try:
        held.line.require_known()
    except CalibrationFileError as fault:
        raise CalibrationFileError(f"{path}: {fault}") from None
    return held
