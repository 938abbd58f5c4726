"""The shapes of the answers, for the API's description; the bytes themselves come ready from board and store."""

from typing import Any, Final

from pydantic import BaseModel, ConfigDict, Field

_ID: Final = "1795233300000000000-0f3a9c2b11de"
_INTERVAL: Final = "95 % interval [low, high]"


class Spectra(BaseModel):
    """Spectra of one batch, arrays of one length."""

    freq_hz: list[float | None] = Field(examples=[[1.17, 1.37, 1.56]])
    vertical_acceleration_mps2_rthz: list[float | None] = Field(examples=[[0.38, 0.62, 0.97]])
    pitch_rate_radps_rthz: list[float | None] = Field(examples=[[0.017, 0.027, 0.038]])
    coherence: list[float | None] = Field(description="0 to 1", examples=[[0.99, 0.98, 0.99]])
    phase_rad: list[float | None] = Field(
        description="of pitch rate against acceleration", examples=[[-2.3, -2.1, -1.9]]
    )


class Estimate(BaseModel):
    """One batch: what it weighed, or why it could not. Unknown is null, never 0."""

    model_config = ConfigDict(extra="allow")

    id: str | None = Field(description="the same for the same batch, whenever it is computed", examples=[_ID])
    vehicle_id: str | None = Field(examples=["van-17"])
    vin: str | None = None
    t_start: str | None = Field(json_schema_extra={"format": "date-time"}, examples=["2026-11-21T03:50:00.000000Z"])
    t_end: str | None = Field(json_schema_extra={"format": "date-time"}, examples=["2026-11-21T03:55:00.000000Z"])
    t_end_ns: int | None = Field(description="ns since 1970 UTC", examples=[1795233300000000000])
    estimator: str | None = Field(examples=["ratio_index"])
    calibration_id: str | None = Field(examples=["sha256:9f86d081"])
    payload_kg: float | None = Field(examples=[271.3])
    payload_std_kg: float | None = Field(examples=[6.1])
    payload_interval95_kg: list[float] | None = Field(description=_INTERVAL, examples=[[259.3, 283.3]])
    front_share_pct: float | None = Field(description="share of the sprung mass on the front axle", examples=[50.4])
    front_share_std_pct: float | None = Field(description="percentage points", examples=[0.1])
    front_share_interval95_pct: list[float] | None = Field(description=_INTERVAL, examples=[[50.2, 50.6]])
    ratio_index_acceleration: float | None = Field(examples=[0.97])
    ratio_index_pitch_rate: float | None = Field(examples=[1.21])
    mean_speed_mps: float | None = Field(examples=[13.9])
    gap_share: float | None = Field(description="share of the batch without samples", examples=[0.001])
    usable_share: float | None = Field(description="share of the batch that every gate let through", examples=[0.93])
    roughness_mps2: float | None = Field(
        None, description="of the road: rms vertical acceleration, 1 to 15 Hz, brought to 80 km/h", examples=[1.1]
    )
    shares: dict[str, float | None] = Field(description="part of the batch that each cause masked", examples=[{}])
    rejected: list[str] = Field(description="why there is no answer; empty: this batch counted", examples=[[]])
    diagnostics: dict[str, float | None] = Field(default_factory=dict, examples=[{}])
    tare_id: str | None = Field(None, description="the zero taken off this answer; absent: the factory zero")
    tare_payload_kg: float | None = Field(None, description="taken off the raw payload", examples=[12.4])
    tare_payload_std_kg: float | None = None
    tare_front_share_pct: float | None = Field(None, description="percentage points taken off the raw front share")
    tare_front_share_std_pct: float | None = None
    raw_payload_kg: float | None = Field(None, description="as the calibration alone has it", examples=[283.7])
    raw_payload_std_kg: float | None = None
    raw_front_share_pct: float | None = None
    raw_front_share_std_pct: float | None = None
    provisional: bool | None = Field(None, description="true: an early look at a batch that is still growing")
    spectra: Spectra | None = None


class Latest(Estimate):
    """The last good estimate, as old as ``age_s`` says; before any, nulls and ``no_estimate_yet``."""

    age_s: float | None = Field(description="since its receipt, on a clock that never steps", examples=[42.0])
    is_stale: bool = Field(description="older than the service's stale_after_s", examples=[False])
    last_rejection: Estimate | None = Field(description="the last batch without an answer (spectra left out)")


class EstimatesPage(BaseModel):
    """A piece of the history, rejections included."""

    items: list[Estimate]
    next_cursor: str | None = Field(description="send as cursor for more; null: no more now", examples=["3f2a9c1e-7"])
    last_cursor: str | None = Field(
        description="place of the newest item: cursor to wait here for what comes", examples=["3f2a9c1e-7"]
    )


class Alive(BaseModel):
    """The process answers."""

    is_alive: bool = True


class Ready(BaseModel):
    """Estimates can come."""

    is_ready: bool = True
    state: str = Field(examples=["estimating"])


class Fault(BaseModel):
    """One thing wrong with a request."""

    where: str = Field(examples=["query.limit"])
    what: str = Field(examples=["Input should be less than or equal to 1000"])


class Problem(BaseModel):
    """Problem details (RFC 9457)."""

    model_config = ConfigDict(json_schema_extra={"x-media-type": "application/problem+json"})

    type: str = "about:blank"
    title: str = Field(examples=["Unprocessable Content"])
    status: int = Field(examples=[422])
    detail: str = Field(examples=["query.limit: Input should be less than or equal to 1000"])
    instance: str | None = Field(None, examples=["/api/v1/estimates"])
    reason: str | None = Field(None, description="for programs, where a person could mend it", examples=["stale"])
    errors: list[Fault] | None = None


def problem_responses(*codes: int) -> dict[int | str, dict[str, Any]]:
    """The ``responses`` of a route that may answer with these problems."""
    return {code: {"model": Problem} for code in codes}
