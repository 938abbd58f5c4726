"""Tables of springscale.toml about a service's own work: what it records and learns, reports and sends."""

from pathlib import Path
from typing import Annotated, Final, Literal, Self
from urllib.parse import urlsplit

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, field_validator, model_validator

from gateway.config.permission import Holder, Kind, encryption_to, may_leave

Seconds = Annotated[float, Field(gt=0.0, le=1e9, allow_inf_nan=False)]  # 32 years: fits 64 bits in nanoseconds
LimitKg = Annotated[float | None, Field(gt=0.0, le=100_000.0, allow_inf_nan=False)]  # road vehicles weigh less
MqttText = Annotated[str, Field(min_length=1, max_length=1000)]  # MQTT can write 65,535 bytes
OF_CALIBRATION = "[default: as the calibration has it]"


def _host(name: str) -> str:
    try:
        name.encode("idna")
    except UnicodeError:
        raise ValueError(f"{name!r} is neither an address nor a name that a host can have") from None
    return name


HostName = Annotated[str, AfterValidator(_host)]


def _may_be_sent_to(host: str, *, has_tls: bool) -> bool:
    return may_leave(Kind.RECORD, encryption_to(host, has_tls=has_tls), Holder.NAMED)


class SettingsSection(BaseModel):
    """A table of the file."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class RecordSection(SettingsSection):
    """The ring log: the mapped frames themselves, kept on disk as long as there is room."""

    enabled: bool = Field(False, description="whether frames are recorded")
    directory: Path | None = Field(None, description="folder of the files [default: `record` in that of the store]")
    max_size_mb: float = Field(1024.0, ge=16.0, le=1e9, description="the oldest files are removed beyond this size")
    free_mb: float = Field(256.0, ge=0.0, le=1e9, description="with less free space on the disk nothing is recorded")


class LearningSection(SettingsSection):
    """Learning the vehicle on its own machine, from ordinary drives and from statements of their loads."""

    is_allowed: bool = Field(True, description="whether users with scope operate may have the vehicle learnt here")
    like: Path | None = Field(None, description="calibration file of a vehicle of the same model: the prior of the fit")
    size_mb: float = Field(100.0, ge=1.0, le=100_000.0, description="disk space for drives to learn from")
    memory_mb: float = Field(
        1024.0, ge=256.0, le=16_384.0, description="address space of the process that learns, which takes less memory"
    )


class PositionSection(SettingsSection):
    """The vehicle's positions that are kept, and whether they may leave the vehicle."""

    decimals: int | None = Field(
        None,
        ge=0,
        le=7,
        description="decimals of a degree kept: 2 is about 1 km, 4 about 10 m [default: no positions are kept]",
    )
    forward: bool = Field(False, description="kept positions also go to [uplink], [webhook] and tokens of scope read")


class UplinkSection(SettingsSection):
    """Where estimates are forwarded to: an MQTT 5 broker, for vehicles that cannot be reached from outside."""

    host: HostName | None = Field(None, min_length=1, description="the broker; without it nothing is forwarded")
    port: int | None = Field(None, ge=1, le=65535, description="its port [default: 8883 with TLS, 1883 without]")
    tls: bool = Field(True, description="encrypted, the broker's certificate checked; without it on this machine alone")
    ca: Path | None = Field(
        None, description="PEM file of the authority that signed the broker's certificate [default: the system's]"
    )
    certificate: Path | None = Field(None, description="PEM file of our certificate, for a broker that requires one")
    key: Path | None = Field(None, description="PEM file of its key")
    username: MqttText | None = Field(None, description="our client identifier at the broker")
    password_file: Path | None = Field(None, description="file that contains only the password")
    topic: MqttText = Field("springscale/{vehicle_id}", description="branch below which this vehicle reports")
    client_id: MqttText | None = Field(None, description="[default: springscale- and the vehicle's id]")
    keep_alive_s: int = Field(60, ge=5, le=3600, description="the link is probed after this long without traffic")
    back_off_max_s: Seconds = Field(300.0, description="longest pause between two tries to connect")
    repeat_s: float = Field(
        0.0,
        ge=0.0,
        le=86_400.0,
        description="after a break, records delivered in the last so many seconds before it are sent again: more than "
        "the broker loses when it is killed",
    )
    wait_for_listener: bool = Field(
        False,
        description="a record without a subscriber at the broker, as MQTT 5 reports it, is kept here and tried again",
    )
    home_assistant: MqttText | None = Field(
        None,
        description="appear in Home Assistant on this broker: its discovery prefix, which is `homeassistant` unless "
        "somebody changed it there",
    )

    statements: bool = Field(
        False, description="take statements of loads from the topic `statements` below this vehicle's"
    )

    @model_validator(mode="after")
    def _keeps_its_secrets(self) -> "UplinkSection":
        if self.statements and self.host is None:
            raise ValueError("statements come from a broker: set host")
        if (self.certificate is None) != (self.key is None):
            raise ValueError("certificate and key belong together: give both or neither")
        if self.password_file is not None and self.username is None:
            raise ValueError("password_file needs username")
        if self.host is not None and not _may_be_sent_to(self.host, has_tls=self.tls):
            raise ValueError("estimates would cross the network in the clear: set tls = true")
        return self


CAUSE_NAMES: Final = (  # those of core.alarms, which loads too much for this
    *("overload", "sensor_fault"),
    *("overload.gross", "overload.front_axle", "overload.rear_axle"),
    *("overload.front_left", "overload.front_right", "overload.rear_left", "overload.rear_right"),
    *("sensor_fault.silent", "sensor_fault.refused"),
)


def _of_a_cause(name: str) -> str:
    if name not in CAUSE_NAMES:
        raise ValueError(f"is no alarm; known are {', '.join(CAUSE_NAMES)}")
    return name


CauseName = Annotated[str, AfterValidator(_of_a_cause)]


class AlarmsSection(SettingsSection):
    """When an alarm is raised and when it ends. Permitted weights are those of the vehicle."""

    off: tuple[CauseName, ...] = Field(
        (), description='unwanted alarms, by name or by kind: `["sensor_fault", "overload.front_left"]`'
    )
    raise_probability: float = Field(
        0.95, gt=0.5, lt=1.0, description="raised if the batches of one load together make it so probable"
    )
    raise_batches: int = Field(2, ge=1, le=20, description="least number of batches of one load")
    clear_probability: float = Field(
        0.25, gt=0.0, le=0.5, description="the alarm ends when the load makes it no more probable than this"
    )
    sensor_silent_s: float = Field(
        600.0,
        ge=10.0,
        le=86_400.0,
        description="a needed sensor that is silent for so long on a live bus raises an alarm",
    )


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
        if not _may_be_sent_to(parts.hostname, has_tls=parts.scheme == "https"):
            raise ValueError("would cross the network in the clear: use https://")
        return url

    @model_validator(mode="after")
    def _signs(self) -> Self:
        if self.url is not None and self.secret_file is None:
            raise ValueError("url needs secret_file")
        return self
