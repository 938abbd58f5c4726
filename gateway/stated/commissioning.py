"""The state of a commissioning as the web shows it; the service fills it from its record."""

from typing import Literal

from pydantic import ConfigDict, Field

from gateway.stated.doubt import DoubtKind
from gateway.stated.facts import Instant, Part, VehicleAnswers


class _Told(Part):
    model_config = ConfigDict(from_attributes=True, extra="ignore")  # the record holds more than is shown


class DoubtTold(_Told):
    """A fact that is unlikely to be true: it must be corrected or confirmed before the next step.

    ``numbers`` are those of the text, ``meant`` the answers that would leave no doubt, if one slip explains it.
    """

    kind: DoubtKind
    numbers: dict[str, float]
    meant: dict[str, float | tuple[float, float]]
    is_of_drive: bool = Field(description="the drive contradicts the stated facts; false: a stated fact is unusual")
    text: str
    advice: str


class EmptyTold(_Told):
    """Who said that the vehicle is empty, and when."""

    at: Instant
    by: str


class FindingTold(Part):
    """What inspection found."""

    kind: str = Field(examples=["pitch_rate_sign"])
    severity: Literal["fault", "warning", "note"]
    text: str
    advice: str


class InspectionTold(_Told):
    """What the last minutes of driving show about axes, signs, units and rates; a fault must be mended first."""

    seconds: float
    has_fault: bool
    findings: list[FindingTold]


class LearnedTold(_Told):
    """The accuracy reached so far and the accuracy needed: standard deviations."""

    payload_std_kg: float
    front_share_std_pct: float
    needed_std_kg: float
    share: float = Field(description="0 to 1 of the goal")
    is_enough: bool


class UnderwayTold(_Told):
    """The commissioning under way, and its next step."""

    step: Literal["vehicle", "empty", "drive", "fit"]
    begun_at: Instant
    by: str
    note: str | None
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


class MadeEnd(Part):
    """How a calibration was replaced."""

    at: Instant
    by: str
    why: Literal["undone", "back_to_factory"]


class MadeTold(_Told):
    """A calibration that was made on the vehicle."""

    id: str
    at: Instant
    by: str
    note: str | None
    sister: str | None = Field(description="name of the vehicle whose calibration gave the prior; null: none")
    vehicle_name: str
    n_batches: int
    learned: LearnedTold | None
    warnings: list[str]
    ended: MadeEnd | None


class CommissioningState(_Told):
    """State of the commissioning, and earlier calibrations, newest first."""

    is_allowed: bool
    why_not: str | None
    is_offered: bool = Field(description="the service has no calibration, and none is pending")
    underway: UnderwayTold | None
    is_pending: bool = Field(description="another calibration than the one at work counts from the next drive on")
    active: MadeTold | None = Field(description="null: the calibration that the settings name, if any")
    history: list[MadeTold]
