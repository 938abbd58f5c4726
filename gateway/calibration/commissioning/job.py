"""The service's jobs for the process that fits, and their results: two JSON files in a folder of their own."""

from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ConfigDict, Field

from gateway.core.vehicle import Vehicle
from gateway.stated.commissioning import FindingTold
from gateway.stated.doubt import Doubt
from gateway.stated.facts import Part

JOB: Final = "job.json"
RESULT: Final = "result.json"
ENOUGH_SHARE: Final = 0.98  # chosen: of the goal; a further 2 % are not worth driving


class _JobTable(Part):
    model_config = ConfigDict(allow_inf_nan=False)


class Drive(_JobTable):
    """Kept batches of one known load."""

    name: str
    payload_kg: float = 0.0
    front_share_pct: float
    payload_left_m: float | None = None
    batches: tuple[Path, ...] = Field(min_length=1, description="files of kept batches")


class Job(_JobTable):
    """Inspect the drives, and also fit them if ``is_fit``; ``like`` is the calibration file of a sister."""

    vehicle: Vehicle
    drives: tuple[Drive, ...] = Field(min_length=1)
    settings: dict[str, Any]
    like: Path | None = None
    is_fit: bool = True
    goal_std_share: float = Field(gt=0.0, description="of the largest payload: the standard deviation that is the goal")
    most_memory_mb: float = Field(gt=0.0)
    command: str


class Learned(_JobTable):
    """The accuracy reached so far: standard deviations over the loads the vehicle may carry."""

    payload_std_kg: float
    front_share_std_pct: float
    needed_std_kg: float = Field(
        description="the goal, or the value that another hour of such driving would no longer improve"
    )

    @property
    def is_enough(self) -> bool:
        """Whether to stop driving."""
        return self.share >= ENOUGH_SHARE

    @property
    def share(self) -> float:
        """0 to 1 of the goal."""
        return min(1.0, self.needed_std_kg / self.payload_std_kg)


class Result(_JobTable):
    """The result of a job. ``fault`` says in words why there is no calibration; its text is that of the file."""

    findings: tuple[FindingTold, ...] = ()
    refusal: str | None = None
    learned: Learned | None = None
    calibration: str | None = None
    calibration_id: str | None = None
    warnings: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    fault: str | None = None
    seconds: float = 0.0
    most_memory_mb: float = 0.0


def to_file(table: BaseModel, path: Path) -> None:
    """For the folder of a job, which is worthless after a power cut."""
    path.write_text(table.model_dump_json(), encoding="utf-8")


def findings_of(findings: Any) -> tuple[FindingTold, ...]:
    """The findings without duplicates, the gravest first."""
    told = dict.fromkeys((one.kind, one.severity, one.text, one.advice) for one in findings)
    order = ("fault", "warning", "note")
    found = [FindingTold(kind=str(k), severity=str(s), text=t, advice=a) for k, s, t, a in told]
    return tuple(sorted(found, key=lambda one: order.index(one.severity)))
