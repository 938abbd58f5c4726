"""Tables of springscale.toml about alarms: when one is raised, and if it is sent."""

from pathlib import Path
from typing import Annotated, Final, Literal, Self
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field, field_validator, model_validator

from gateway.config.sections import SettingsSection

CAUSE_NAMES: Final = (  # those of core.alarms, which loads too much for this
    *("overload", "imbalance", "sensor_fault", "drift", "no_estimate"),
    *("overload.gross", "overload.front_axle", "overload.rear_axle"),
    *("overload.front_left", "overload.front_right", "overload.rear_left", "overload.rear_right"),
    *("imbalance.left_right", "imbalance.front_rear", "sensor_fault.silent", "sensor_fault.refused"),
    *("drift.damper_front", "drift.damper_rear", "drift.delay", "drift.gyro_gain", "drift.zero"),
)


def _of_a_cause(name: str) -> str:
    if name not in CAUSE_NAMES:
        raise ValueError(f"is no alarm; known are {', '.join(CAUSE_NAMES)}")
    return name


CauseName = Annotated[str, AfterValidator(_of_a_cause)]


class AlarmsSection(SettingsSection):
    """When an alarm is raised, confirmed and ended. Permitted weights are those of the vehicle."""

    off: tuple[CauseName, ...] = Field(
        (), description='unwanted alarms, by name or by kind: `["drift", "overload.front_left"]`'
    )
    early_probability: float = Field(
        0.9, gt=0.5, lt=1.0, description="raised early if it is so probable that a limit is exceeded, even by one batch"
    )
    final_probability: float = Field(
        0.95, gt=0.5, lt=1.0, description="confirmed if the batches of one load together make it so probable"
    )
    final_batches: int = Field(2, ge=2, le=20, description="least number of batches of one load")
    clear_probability: float = Field(
        0.25, gt=0.0, le=0.5, description="the alarm ends when the load makes it no more probable than this"
    )
    side_share_max_pct: float = Field(
        55.0, ge=50.0, le=100.0, description="of the sprung mass, on the wheels of one side (needs a roll rate)"
    )
    axle_share_max_pct: float = Field(75.0, ge=50.0, le=100.0, description="of the sprung mass, on one axle")
    sensor_silent_s: float = Field(
        60.0,
        ge=10.0,
        le=86_400.0,
        description="a needed sensor that is silent for so long on a live bus raises an alarm",
    )
    sensor_silent_final_s: float = Field(600.0, ge=10.0, le=86_400.0, description="likewise, for sure")
    no_estimate_min: float = Field(
        120.0,
        ge=5.0,
        le=10_000.0,
        description="minutes driven without an estimate before an early alarm; twice as long confirms it",
    )

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.sensor_silent_final_s < self.sensor_silent_s:
            raise ValueError("sensor_silent_final_s must not be below sensor_silent_s")
        return self


_LOCAL: Final = frozenset({"127.0.0.1", "::1", "localhost"})


class WebhookSection(SettingsSection):
    """Where alarms and events are pushed to: an address that takes signed HTTP requests."""

    url: str | None = Field(
        None, description="its address, https:// (http:// on this machine alone); without it nothing is pushed"
    )
    secret_file: Path | None = Field(
        None, description="file with the secret we sign with: `whsec_` and base64, a line each; the first is the newest"
    )
    ca: Path | None = Field(
        None, description="PEM file of the authority that signed the receiver's certificate [default: the system's]"
    )
    send: tuple[Literal["alarms", "events", "trips", "estimates"], ...] = Field(
        ("alarms", "events"), min_length=1, description="what it is sent"
    )
    timeout_s: float = Field(20.0, ge=1.0, le=300.0, description="time limit for an answer")
    back_off_max_s: float = Field(300.0, gt=0.0, le=86_400.0, description="longest pause between two tries")
    give_up_h: float = Field(
        72.0, gt=0.0, le=8760.0, description="hours after which a letter that is answered with a refusal is given up"
    )

    @field_validator("url")
    @classmethod
    def _is_an_address(cls, url: str | None) -> str | None:
        if url is None:
            return None
        parts = urlsplit(url)  # raises ValueError for a port that is none, when it is asked for
        if parts.scheme not in {"https", "http"} or not parts.hostname or (parts.port or 1) < 1:
            raise ValueError("is no https:// address")
        if parts.username is not None or parts.fragment or not url.isascii() or not url.isprintable() or " " in url:
            raise ValueError("may contain neither a user nor a fragment, and no character that must be escaped")
        if parts.scheme == "http" and parts.hostname not in _LOCAL:
            raise ValueError("would cross the network in the clear: use https://")
        return url

    @model_validator(mode="after")
    def _signs(self) -> Self:
        if self.url is not None and self.secret_file is None:
            raise ValueError("url needs secret_file")
        return self
