"""What is asked about a stated fact that is unlikely to be true: a question with numbers, and what to do.

A doubt is no refusal. Whoever knows better confirms it, and it stays with the calibration as a warning.
"""

from enum import StrEnum
from typing import Final, Self

from pydantic import BaseModel, ConfigDict, Field, computed_field

_MEASURE: Final = "measure from the middle of the front wheel to the middle of the rear wheel"
_SCALES: Final = "read the ticket of the scales again, axle by axle, in kilograms"
_PAPERS: Final = "read the vehicle's papers again, in kilograms"


class DoubtKind(StrEnum):
    """What a doubt is about. docs/teach.md lists them."""

    text: str  # the fact with its numbers
    advice: str

    def __new__(cls, name: str, text: str, advice: str) -> Self:
        kind = str.__new__(cls, name)
        kind._value_ = name
        kind.text, kind.advice = text, advice
        return kind

    # fmt: off
    WHEELBASE = ("wheelbase",
        "{wheelbase_m:g} m from axle to axle: vehicles with two axles have {low_m:g} to {high_m:g} m",
        _MEASURE)
    MASS = ("mass",
        "{gross_kg:.0f} kg empty on a wheelbase of {wheelbase_m:g} m: such vehicles weigh {low_kg:.0f} to "
        "{high_kg:.0f} kg",
        _SCALES)
    FRONT_SHARE = ("front_share",
        "{front_pct:.0f} % of the empty weight on the front axle: vehicles have {low_pct:.0f} to {high_pct:.0f} %",
        "were front and rear exchanged, or was one axle weighed with a load? " + _SCALES)
    SISTER_MASS = ("sister_mass",
        "{gross_kg:.0f} kg empty: its sister weighs about {sister_kg:.0f} kg",
        _SCALES + "; or name another sister in the settings")
    SISTER_AXLES = ("sister_axles",
        "{front_kg:.0f} kg in front and {rear_kg:.0f} kg at the rear: its sister weighs {sister_front_kg:.0f} and "
        "{sister_rear_kg:.0f} kg there",
        _SCALES + "; or name another sister in the settings")
    SISTER_TRACK = ("sister_track",
        "a track of {track_m:g} m: its sister has {sister_m:g} m",
        "measure between the middles of the left and the right tyre")
    SENSOR_PLACE = ("sensor_place",
        "a sensor {sensor_m:g} m behind the front axle, with axles {wheelbase_m:g} m apart, is outside the vehicle",
        "measure from the middle of the front wheel towards the rear; negative is ahead of it")
    SENSOR_SIDE = ("sensor_side",
        "a sensor {sensor_m:g} m to the left of the centre line is outside the vehicle",
        "measure from the middle of the vehicle; negative is to the right")
    TRACK = ("track",
        "a track of {track_m:g} m: vehicles have {low_m:g} to {high_m:g} m",
        "measure between the middles of the left and the right tyre")
    UNSPRUNG = ("unsprung",
        "{unsprung_kg:.0f} kg of wheels and brakes on one axle: {low_kg:.0f} to {high_kg:.0f} kg are usual",
        "leave it empty where nobody weighed it")
    SPRUNG = ("sprung",
        "a sprung mass of {sprung_kg:.0f} kg under axle weights of {gross_kg:.0f} kg",
        "leave it empty: it follows from the axle weights")
    PAYLOAD = ("payload",
        "{payload_kg:.0f} kg of payload on a vehicle that weighs {gross_kg:.0f} kg empty",
        _PAPERS)
    PAYLOAD_LIMIT = ("payload_limit",
        "{gross_kg:.0f} kg empty and {payload_kg:.0f} kg of payload are {sum_kg:.0f} kg: {limit_kg:.0f} kg are "
        "permitted",
        _PAPERS)
    GROSS_LIMIT = ("gross_limit",
        "a permitted gross weight of {limit_kg:g} kg: the vehicle weighs {gross_kg:.0f} kg empty",
        "it is more than that, and no more than both axles may carry: " + _PAPERS)
    AXLE_LIMIT = ("axle_limit",
        "an axle limit of {limit_kg:g} kg on an axle that weighs {axle_kg:.0f} kg empty",
        _PAPERS)
    LOAD_LENGTH = ("load_length",
        "a load {length_m:g} m long on a wheelbase of {wheelbase_m:g} m",
        "say how far the load reaches along the floor")
    LOAD_HEIGHT = ("load_height",
        "a load {height_m:g} m high",
        "say how high it reaches above the floor")
    DRIVEN_WEIGHT = ("driven_weight",
        "by the way it moves the vehicle weighs {front_kg:.0f} ± {front_95_kg:.0f} kg in front and {rear_kg:.0f} ± "
        "{rear_95_kg:.0f} kg at the rear (95 %), not {said_front_kg:.0f} and {said_rear_kg:.0f}",
        "check that nothing is loaded and read the axle weights again; then drive empty again. If both are "
        "right, it is of another model than its sister")
    DRIVEN_SISTER = ("driven_sister",
        "springs, dampers and tyres differ from its sister's by more than those of one model do",
        "calibrate like another sister, or like none; worn dampers and a wrong tyre pressure look like this too")
    DRIVEN_WHEELBASE = ("driven_wheelbase",
        "bumps reach the rear axle as if it were {found_m:.2f} ± {within_m:.2f} m behind the front axle, not "
        "{said_m:g} m",
        _MEASURE + "; where that is right, the signal map's speed is wrong by as much")
    DRIVEN_SENSOR = ("driven_sensor",
        "the sensor moves as if it were {found_m:.2f} ± {within_m:.2f} m behind the front axle, not {said_m:g} m",
        "measure from the middle of the front wheel towards the rear; negative is ahead of it")
    # fmt: on


class Doubt(BaseModel):
    """A stated figure that is unlikely: correct it, or confirm it; until then nothing is learnt."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    kind: DoubtKind
    numbers: dict[str, float] = Field(exclude=True, description="of its words, in the units their names end in")

    @classmethod
    def of(cls, kind: DoubtKind, **numbers: float) -> Self:
        """The doubt with its numbers rounded to what people read."""
        return cls(kind=kind, numbers={name: round(number, 4) for name, number in numbers.items()})

    @computed_field  # type: ignore[prop-decorator]  # as pydantic asks for
    @property
    def text(self) -> str:
        """The fact, as part of a sentence."""
        return self.kind.text.format(**self.numbers)

    @computed_field  # type: ignore[prop-decorator]  # as pydantic asks for
    @property
    def advice(self) -> str:
        """Advice on what to do, as part of a sentence."""
        return self.kind.advice

    @property
    def sentence(self) -> str:
        """All of it."""
        return f"{self.text}: {self.advice}"
