"""The shapes of the answers, for the API's description; board and store provide the finished bytes."""

from datetime import UTC, datetime, timedelta
from http import HTTPStatus
from typing import Annotated, Any, Final, Generic, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema, create_model, model_validator

from gateway.estimates.as_json import FIELDS, EstimateField, Presence
from gateway.estimates.batch_estimate import Lack
from gateway.estimates.field_kinds import INSTANT, NUMBERS_BY_NAME, SPECTRA, WEIGHTS
from gateway.stated.statement import HALF_CHARACTER, is_text

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


def parse_instant(text: object) -> int:
    """2026-11-21T04:00:00.5+01:00 -> ns since 1970 UTC, to a microsecond. Raises ValueError that says what is
    expected.
    """
    try:
        return (datetime.fromisoformat(str(text)) - _EPOCH) // timedelta(microseconds=1) * 1000
    except (TypeError, ValueError):  # TypeError: it names no zone
        raise ValueError(
            "write a date and time with its zone, such as 2026-11-21T04:00:00Z (in a URL, the + of a zone is %2B)"
        ) from None


Instant = Annotated[
    int,
    BeforeValidator(parse_instant),
    WithJsonSchema({"type": "string", "format": "date-time", "examples": ["2026-11-21T04:00:00Z"]}),
]


class Spectra(BaseModel):
    """Spectra of one batch, arrays of one length."""

    freq_hz: list[float | None] = Field(examples=[[1.17, 1.37, 1.56]])
    vertical_acceleration_mps2_rthz: list[float | None] = Field(examples=[[0.38, 0.62, 0.97]])
    pitch_rate_radps_rthz: list[float | None] = Field(examples=[[0.017, 0.027, 0.038]])
    coherence: list[float | None] = Field(description="0 to 1", examples=[[0.99, 0.98, 0.99]])
    phase_rad: list[float | None] = Field(
        description="of pitch rate against acceleration", examples=[[-2.3, -2.1, -1.9]]
    )


class WeightFigure(BaseModel):
    """One weight; null is unknown."""

    kg: float | None = Field(examples=[1894.2])
    std_kg: float | None = Field(examples=[6.1])
    interval95_kg: tuple[float, float] | None = Field(examples=[[1882.2, 1906.2]])
    limit_kg: float | None = Field(description="null: no limit is known", examples=[2100.0])
    is_over_limit: bool = Field(examples=[False])
    lacks: Lack | None = Field(description="facts that are missing for it; null: it is known", examples=[None])
    is_unsprung_estimated: bool = Field(
        False,
        description="whether its unsprung mass was found by calibration: none was stated",
        examples=[False],
    )


class WeightFigures(BaseModel):
    """Static weights by place, unsprung masses included."""

    gross: WeightFigure
    front_axle: WeightFigure
    rear_axle: WeightFigure
    front_left: WeightFigure
    front_right: WeightFigure
    rear_left: WeightFigure
    rear_right: WeightFigure


_SHAPES: Final[Any] = {SPECTRA: Spectra | None, WEIGHTS: WeightFigures | None}


def _described(one: EstimateField) -> Any:
    """One row of the table of fields as a field of a pydantic model."""
    described: dict[str, Any] = {"description": one.description}
    if one.example is not None:
        described["examples"] = [one.example]
    if one.kind is INSTANT:
        described["json_schema_extra"] = {"format": "date-time"}
    if one.presence is not Presence.ALWAYS:
        described |= {"default_factory": dict} if one.kind is NUMBERS_BY_NAME else {"default": None}
    return _SHAPES.get(one.kind, one.kind.shape), Field(**described)


Estimate: Final = create_model(
    "Estimate",
    __config__=ConfigDict(extra="allow"),
    __doc__="One batch: its estimate, or why there is none. Unknown is null, never 0.",
    **{one.name: _described(one) for one in FIELDS},
)

Latest: Final = create_model(
    "Latest",
    __base__=Estimate,
    __doc__="The last good estimate, ``age_s`` old; before any, nulls and ``no_estimate_yet``.",
    age_s=(float | None, Field(description="since its receipt, on a clock that never steps", examples=[42.0])),
    is_stale=(bool, Field(description="older than the service's stale_after_s", examples=[False])),
    is_stored=(
        bool | None,
        Field(
            description="false: in memory only, because the disk takes nothing; null: an early look or none, which is "
            "not stored",
            examples=[True],
        ),
    ),
    last_rejection=(Estimate | None, Field(description="the last batch without an answer (spectra left out)")),
)


Item = TypeVar("Item")


class Page(BaseModel, Generic[Item]):
    """A piece of the history."""

    items: list[Item]
    next_cursor: str | None = Field(description="send as cursor for more; null: no more now", examples=["3f2a9c1e-7"])
    last_cursor: str | None = Field(
        description="place of the newest item: cursor to wait here for new ones", examples=["3f2a9c1e-7"]
    )


EstimatesPage: Final[Any] = Page[Estimate]


class Alive(BaseModel):
    """The process answers."""

    is_alive: bool = True


class Ready(BaseModel):
    """Estimates can come."""

    is_ready: bool = True
    state: str = Field(examples=["estimating"])
    warnings: list[str] = Field([], description="faults that do not stop the weighing")


def utf8_only(said: Any) -> Any:
    """JSON can escape half of a character (a lone surrogate): that is not text, and UTF-8 cannot encode it."""
    if not is_text(said):
        raise ValueError(HALF_CHARACTER)
    return said


class Body(BaseModel):
    """The JSON of a request: unknown keys are refused, and so is text that no answer could repeat."""

    model_config = ConfigDict(extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _is_utf8(cls, said: Any) -> Any:
        return utf8_only(said)


class Fault(BaseModel):
    """One thing wrong with a request."""

    where: str = Field(examples=["query.limit"])
    what: str = Field(examples=["Input should be less than or equal to 1000"])


class Problem(BaseModel):
    """Problem details (RFC 9457)."""

    type: str = "about:blank"
    title: str = Field(examples=["Unprocessable Content"])
    status: int = Field(examples=[422])
    detail: str = Field(examples=["query.limit: Input should be less than or equal to 1000"])
    instance: str | None = Field(None, examples=["/api/v1/estimates"])
    reason: str | None = Field(None, description="for programs, if a person can mend it", examples=["stale"])
    errors: list[Fault] | None = None


PROBLEM_TYPE: Final = "application/problem+json"
_PROBLEM: Final[dict[str, Any]] = Problem.model_json_schema()
_PROBLEM["properties"]["errors"]["anyOf"][0]["items"] = _PROBLEM.pop("$defs")["Fault"]  # it stands in many places


def problem_responses(*codes: int) -> dict[int | str, dict[str, Any]]:
    """The ``responses`` of a route that may answer with these problems."""
    content = {PROBLEM_TYPE: {"schema": _PROBLEM}}
    return {code: {"description": HTTPStatus(code).phrase, "content": content} for code in codes}
