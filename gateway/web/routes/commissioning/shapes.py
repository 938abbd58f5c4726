"""Requests and answers while a vehicle is commissioned."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from gateway.stated import VehicleAnswers
from gateway.stated.doubt import DoubtKind
from gateway.web.schemas import Body

Source = Literal["package", "administrator", "uploaded"]


class Begin(Body):
    """Starts a commissioning; forbidden while another is under way."""

    note: str = Field("", max_length=200, description="kept in the history")


class LineNamed(BaseModel):
    """A file among the available lines."""

    model_config = ConfigDict(extra="forbid")

    name: str = Field(max_length=64, examples=["van-model.json"])
    source: Source


class ChooseLine(Body):
    """One of the available lines; null: none, with the prior of any vehicle."""

    line: LineNamed | None


class ClaimEmpty(Body):
    """The claim that the drive rests on."""

    again: bool = Field(False, description="discard the drive so far: the vehicle was not empty then")

    is_empty: Literal[True] = Field(
        description="you know that the vehicle is empty, and will be until the calibration is made"
    )


class UploadLine(Body):
    """The calibration of a vehicle of the same model, or a line file, from your disk."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]{0,58}\.json$", examples=["van-model.json"])
    content: str = Field(max_length=1_000_000, description="the file's text")
    signature: str | None = Field(
        None, max_length=4096, description="the text of its .sig, if the service requires signatures"
    )


class LineTold(BaseModel):
    """The chosen line; no name: none."""

    name: str
    id: str | None
    source: Source | None


class ChosenLine(LineTold):
    """The same with those of its figures that prefill the form."""

    vehicle: dict[str, object]


class DoubtTold(BaseModel):
    """A fact that is unlikely to be true: it must be corrected or confirmed before the next step.

    ``numbers`` are those of the text, ``meant`` the answers that would leave no doubt, if one slip explains it.
    """

    kind: DoubtKind
    numbers: dict[str, float]
    meant: dict[str, float | tuple[float, float]]
    is_of_drive: bool = Field(description="the drive contradicts the stated facts; false: a stated fact is unusual")
    text: str
    advice: str


class EmptyTold(BaseModel):
    """Who said that the vehicle is empty, and when."""

    at: str = Field(json_schema_extra={"format": "date-time"})
    by: str


class FindingTold(BaseModel):
    """What inspection found."""

    kind: str = Field(examples=["pitch_rate_sign"])
    severity: Literal["fault", "warning", "note"]
    text: str
    advice: str


class InspectionTold(BaseModel):
    """What the last minutes of driving show about axes, signs, units and rates; a fault must be mended first."""

    seconds: float
    has_fault: bool
    findings: list[FindingTold]


class LearnedTold(BaseModel):
    """The accuracy reached so far and the accuracy needed: standard deviations."""

    payload_std_kg: float
    front_share_std_pct: float
    needed_std_kg: float
    share: float = Field(description="0 to 1 of the goal")
    is_enough: bool


class UnderwayTold(BaseModel):
    """The commissioning under way, and its next step."""

    step: Literal["line", "vehicle", "empty", "drive", "fit"]
    begun_at: str = Field(json_schema_extra={"format": "date-time"})
    by: str
    note: str | None
    line: ChosenLine | None
    vehicle: VehicleAnswers | None
    empty: EmptyTold | None = Field(description="null: nobody has said that it is empty")
    doubts: list[DoubtTold] = Field(description="what is asked still")
    confirmed: list[DoubtTold] = Field(description="doubts that were confirmed")
    inspection: InspectionTold | None = Field(description="null: no driving yet")
    n_batches: int = Field(description="of the empty drive that count")
    driven_s: float = Field(description="seconds in them, including the open one")
    next_window_s: float | None = Field(description="until the next one counts; null: the vehicle stands")
    learned: LearnedTold | None = Field(description="null: before the first batch is fitted")
    is_fitting: bool
    fault: str | None = Field(description="why the last fit made no calibration")


class MadeEnd(BaseModel):
    """How a calibration was replaced."""

    at: str = Field(json_schema_extra={"format": "date-time"})
    by: str
    why: Literal["undone", "back_to_factory"]


class MadeTold(BaseModel):
    """A calibration that was made on the vehicle."""

    id: str
    at: str = Field(json_schema_extra={"format": "date-time"})
    by: str
    note: str | None
    line: LineTold
    vehicle_name: str
    n_batches: int
    learned: LearnedTold | None
    warnings: list[str]
    ended: MadeEnd | None


class CommissioningState(BaseModel):
    """State of the commissioning, and earlier calibrations, newest first."""

    is_allowed: bool
    why_not: str | None
    is_offered: bool = Field(description="the service has no calibration, and none is pending")
    underway: UnderwayTold | None
    is_pending: bool = Field(description="another calibration than the one at work counts from the next drive on")
    active: MadeTold | None = Field(description="null: the calibration that the settings name, if any")
    history: list[MadeTold]


class LineFoundTold(BaseModel):
    """A file to choose; a fault says why it cannot be used. ``vehicle`` are its figures, to fill a form with."""

    name: str
    source: Source
    id: str | None
    vehicle: dict[str, object] | None
    fault: str | None


class LinesFound(BaseModel):
    """Every line there is."""

    items: list[LineFoundTold]
