"""What a service tells of statements, of the vehicle that it learns, and of how well it knows it."""

from typing import Any, Final, Literal

from pydantic import Field

from gateway.stated.doubt import Doubt
from gateway.stated.facts import Instant, Part, VehicleAnswers
from gateway.stated.statement import StatementRecord, Text

StatementState = Literal["waiting", "used", "weak", "held", "checked", "withdrawn"]
STATES: Final[tuple[StatementState, ...]] = ("waiting", "used", "weak", "held", "checked", "withdrawn")


class FoundKg(Part):
    """A payload that was found, and half its 95 % interval."""

    payload_kg: float
    plus_minus_kg: float


class StatementTold(StatementRecord):
    """A statement with what became of it."""

    vehicle: str | None = Field(None, description="the vehicle that it is of")
    at: Instant = Field(description="when the service took it")
    state: StatementState = Field(
        description="waiting: for its drive, or for the next fit; used: learnt from; weak: it counts less; held: not "
        "learnt from until it is confirmed or corrected; checked: compared only; withdrawn: no longer there"
    )
    found: FoundKg | None = Field(None, description="what the vehicle said without this statement; null: not known yet")
    reason: str | None = Field(None, description="why it waits, is held or is withdrawn, as a sentence")
    question: str | None = Field(None, description="what is asked about it, with what was probably meant")
    drives: tuple[str, ...] = Field((), description="begin of each drive, or part of one, for which it holds")


class ProblemRow(Part):
    """A row of an import of which nothing is learnt at once, and why."""

    row: int
    kind: Literal["bad", "unknown_vehicle", "waits", "overlap", "replaced"]
    text: str


class ImportTold(Part):
    """What became of several statements. A dry run stores nothing."""

    n_rows: int
    n_match: int = Field(description="rows that match a drive which is kept")
    text: str = Field(
        examples=["38 rows: 31 match a drive, 4 wait, 2 overlap (rows 9, 10), 1 unknown vehicle (row 12)"]
    )
    problems: list[ProblemRow]
    notes: list[str] = Field(description="on the file as a whole")
    items: list[StatementTold] = Field(description="what was stored; empty for a dry run")
    is_dry_run: bool


class StatementPage(Part):
    """Statements, the newest first."""

    items: list[StatementTold]
    next_cursor: str | None = Field(description="cursor of the next page; null: there are no more")


class Help(Part):
    """Something to state or to drive, and what it would make of the accuracy."""

    do: str = Field(examples=["scale"])
    then_plus_minus_kg: float
    text: str = Field("", description="the same in words")


class Question(Part):
    """Something that only a person can answer.

    ``propose`` are the statements to send if the answer is yes; if it is no, send their `from` to /api/v1/learning as
    `not_empty`. ``statement_id`` is the one that is asked about:
    confirm it, or withdraw it and state it anew.
    """

    kind: Literal["looks_empty", "held", "weak"]
    text: str
    statement_id: str | None = None
    propose: tuple[dict[str, Any], ...] = ()


class Version(Part):
    """A calibration that was learnt here."""

    id: str = Field(examples=["sha256:9f86d081"])
    at: Instant
    text: str = Field(examples=["since 14 drives and 3 notes: ± 62 kg became ± 34 kg"])
    plus_minus_kg: float | None
    n_drives: int
    n_statements: int


class VersionTold(Version):
    """A calibration that was learnt here, and whether it is used."""

    state: Literal["in_use", "next_drive", "earlier", "worse"] = Field(
        description="worse: it predicts statements that were left out worse than the one before, and is not used"
    )


class LearningState(Part):
    """How well the vehicle is known, and what would help."""

    is_allowed: bool
    why_not: str | None
    vehicle_time: Instant = Field(
        description="now: by this computer, or by the bus where its time is days away from it, as in a replay"
    )
    plus_minus_kg: float | None = Field(description="of a middling payload now; null: nothing is learnt yet")
    useful_at_kg: float | None = Field(description="from this ± on it is of use; null: the vehicle is not stated yet")
    tested_on: int = Field(description="drives with a statement that were left out and weighed")
    helps: list[Help] = Field(description="what would narrow ±, the most useful first")
    findings: list[str]
    takes_effect: Literal["next_drive"] | None = Field(description="null: no other calibration waits")
    lacks: list[Literal["vehicle", "confirmed_vehicle", "drives"]] = Field(description="before anything can be learnt")
    is_learning: bool = Field(description="a fit is under way")
    driven_s: float = Field(description="driving that can teach, from the first second on")
    n_drives: int
    n_windows_lost: int = Field(description="windows since the start that could have taught and were not kept")
    statements: dict[str, int] = Field(description="how many are in each state")
    questions: list[Question]
    versions: list[VersionTold] = Field(description="the newest first")
    held_version: str | None = Field(description="the version that somebody chose; null: the newest good one is used")
    fault: str | None


class SisterTold(Part):
    """The vehicle of the same model whose calibration is the prior of what is learnt."""

    name: str
    calibration_id: str | None = Field(description="of the file that was handed in; null: the settings name it")


class StatedVehicle(Part):
    """The vehicle as somebody stated it to the service."""

    figures: VehicleAnswers
    by: Text
    at: Instant
    doubts: list[Doubt]
    is_confirmed: bool = Field(description="somebody confirmed that unlikely figures are right")
