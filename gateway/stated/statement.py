"""A statement: what somebody knows of a vehicle's load, and when. The same record in files, over HTTP and in commands.

± is half of a 95 % interval. A statement without ``until`` holds until the load changes; one without a drive waits.
"""

import hashlib
import json
from datetime import datetime
from enum import StrEnum
from typing import Annotated, Final, Self

from pydantic import AfterValidator, AwareDatetime, ConfigDict, Field, model_validator

from gateway.core.vehicle import Carries, Kilograms, Metres, MetresLeft, WeightKg
from gateway.stated.facts import Part

PlusMinusKg = Annotated[float, Field(gt=0.0, le=100_000.0)]
PlusMinusM = Annotated[float, Field(gt=0.0, le=20.0)]
Text = Annotated[str, Field(max_length=200)]


def of_a_drive(at: datetime) -> datetime:
    """The same time. Raises ValueError for a year in which no vehicle with a CAN bus drives."""
    if not 1970 <= at.year <= 2250:
        raise ValueError("not a year of a drive")
    return at


Moment = Annotated[AwareDatetime, AfterValidator(of_a_drive)]


class StatementSource(StrEnum):
    """Where a statement comes from."""

    EMPTY = "empty"
    DELIVERY_NOTE = "delivery_note"
    SCALE = "scale"
    AXLE_SCALES = "axle_scales"
    KNOWN = "known"


class _Numbers(Part):
    model_config = ConfigDict(allow_inf_nan=False)


class StatedLoad(_Numbers):
    """How heavy the load is, in one of four ways."""

    payload_kg: Kilograms | None = Field(None, description="load in addition to the empty vehicle")
    gross_kg: WeightKg | None = Field(None, description="of the whole vehicle, by scales")
    front_axle_kg: WeightKg | None = Field(None, description="under the front axle, by scales; with `rear_axle_kg`")
    rear_axle_kg: WeightKg | None = Field(None, description="likewise at the rear")
    change_kg: Annotated[float, Field(ge=-100_000.0, le=100_000.0)] | None = Field(
        None, description="taken aboard since the statement before, negative: dropped"
    )
    plus_minus_kg: PlusMinusKg | None = Field(
        None, description="half the 95 % interval of each weight; null: the usual one of the source"
    )

    @model_validator(mode="after")
    def _is_one_way(self) -> Self:
        if (self.front_axle_kg is None) is not (self.rear_axle_kg is None):
            raise ValueError("front_axle_kg and rear_axle_kg belong together: give both, or gross_kg")
        told = (self.payload_kg, self.gross_kg, self.front_axle_kg, self.change_kg)
        n_ways = sum(kg is not None for kg in told)
        if n_ways > 1:
            raise ValueError("says the load twice: give one of payload_kg, gross_kg, both axles or change_kg")
        if not n_ways:
            raise ValueError("says no load: give payload_kg, gross_kg, front_axle_kg with rear_axle_kg, or change_kg")
        return self


class StatedPlace(_Numbers):
    """Where the load's centre of gravity is."""

    behind_front_axle_m: Metres | None = None
    plus_minus_m: PlusMinusM | None = Field(
        None, description="half the 95 % interval; null: the usual one of the source"
    )
    left_m: MetresLeft | None = Field(None, description="of the centre line; negative: right of it")


class StatedShape(Part):
    """What kind of goods it is."""

    carries: Carries | None = None


class StatementRecord(Part):
    """One statement. ``ref`` is the sender's own name for it: a later statement with the same one replaces it."""

    model_config = ConfigDict(populate_by_name=True)

    id: Text = Field("", description="given by whoever stores it; empty: made from the content")
    ref: Text | None = Field(None, examples=["LS-4711"])
    from_: Moment = Field(alias="from", description="from when it holds", examples=["2026-11-26T07:40:00Z"])
    until: Moment | None = Field(None, description="null: until the load changes")
    source: StatementSource
    load: StatedLoad
    place: StatedPlace | None = None
    shape: StatedShape | None = None
    learn: bool = Field(True, description="false: compared with what was found, and never learnt from")
    confirmed: bool = Field(False, description="true: learnt from, although the drive may contradict it")
    by: Text = ""
    note: Text = ""

    @model_validator(mode="before")
    @classmethod
    def _empty_says_its_load(cls, told: object) -> object:
        if isinstance(told, dict) and told.get("source") == StatementSource.EMPTY and not told.get("load"):
            return {**told, "load": {"payload_kg": 0.0}}
        return told

    @model_validator(mode="after")
    def _is_possible(self) -> Self:
        if self.until is not None and self.until <= self.from_:
            raise ValueError("until is not after from")
        if self.source is StatementSource.EMPTY and self.load.payload_kg != 0.0:
            raise ValueError("source empty with a load: leave the load out, or give another source")
        if self.source is StatementSource.AXLE_SCALES and self.load.front_axle_kg is None:
            raise ValueError("source axle_scales wants front_axle_kg and rear_axle_kg; a sum alone is of source scale")
        return self

    @property
    def from_ns(self) -> int:
        """The first moment of the statement, in nanoseconds since 1970."""
        return _ns(self.from_)

    @property
    def until_ns(self) -> int | None:
        """The last moment of the statement; None: it holds until the load changes."""
        return None if self.until is None else _ns(self.until)

    def identified(self) -> Self:
        """The statement with an id: its own, or one made from its content."""
        if self.id:
            return self
        content = json.dumps(self.model_dump(mode="json", by_alias=True), sort_keys=True)
        return self.model_copy(update={"id": f"s-{hashlib.sha256(content.encode()).hexdigest()[:12]}"})


TYPES: Final = ("application/json", "text/csv", "text/plain", "application/csv", "application/vnd.ms-excel")
"""Content types of statements: records as JSON, or a table; the leading characters decide which of both it is."""

HALF_CHARACTER: Final = "contains half a character (a lone surrogate), which is not text"


def is_text(told: object) -> bool:
    """Whether all strings of a JSON value are text: JSON can escape half of a character, which UTF-8 cannot encode."""
    try:
        json.dumps(told, ensure_ascii=False, default=str).encode()
    except UnicodeEncodeError:
        return False
    return True


def _ns(at: datetime) -> int:
    return round(at.timestamp() * 1e6) * 1000
