"""A job for the process that learns, and its result: two JSON files in a folder of their own."""

from pathlib import Path
from typing import Any, Final

from pydantic import ConfigDict, Field

from gateway.core.vehicle import Vehicle
from gateway.stated.facts import Part
from gateway.stated.statement import StatementRecord

JOB: Final = "job.json"
RESULT: Final = "result.json"


class LearnJob(Part):
    """Learn a vehicle from these windows and statements.

    ``like`` is the calibration file of a sister, ``before`` the one in use, which the new one must not be worse than.
    """

    model_config = ConfigDict(allow_inf_nan=False)

    key: str = Field(description="of what is learnt from; the same key gives the same calibration")
    vehicle: Vehicle
    windows: tuple[Path, ...] = Field(min_length=1, description="files of kept windows")
    records: tuple[StatementRecord, ...]
    settings: dict[str, Any]
    laden: tuple[tuple[int, int], ...] = Field((), description="begin and end (ns) of times that are not asked about")
    like: Path | None = None
    before: Path | None = None
    is_file_before: bool = Field(False, description="the one in use is of the settings: it stands until it is compared")
    most_memory_mb: float = Field(gt=0.0)


class LearnResult(Part):
    """What came of a job. ``fault`` says in words why there is no calibration; its text is that of the file."""

    key: str = Field("", description="that of its job; empty: there is no result of the process")
    fault: str | None = None
    was_killed: bool = Field(False, description="it was ended from outside, so that the same job may succeed later")
    calibration: str | None = None
    calibration_id: str | None = None
    learning: dict[str, Any] = Field(default_factory=dict)
    statements: tuple[dict[str, Any], ...] = ()
    drives: tuple[dict[str, Any], ...] = ()
    looks_empty: tuple[int, ...] = ()
    damaged: tuple[str, ...] = Field((), description="names of files of windows that could not be read")
    worse: str | None = Field(None, description="why the calibration before is to be preferred; null: it is not")
    seconds: float = 0.0
    most_memory_mb: float = 0.0
