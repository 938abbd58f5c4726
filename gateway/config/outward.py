"""Tables of springscale.toml about where weights are sent: to a fleet's broker, and onto another CAN bus."""

from pathlib import Path

from pydantic import Field, model_validator

from gateway.config.sections import Seconds, SettingsSection


class UplinkSection(SettingsSection):
    """Where estimates are forwarded to: an MQTT 5 broker, for vehicles that cannot be reached from outside."""

    host: str | None = Field(None, min_length=1, description="the broker; without it nothing is forwarded")
    port: int | None = Field(None, ge=1, le=65535, description="its port [default: 8883 with TLS, 1883 without]")
    tls: bool = Field(True, description="encrypted, the broker's certificate checked")
    ca: Path | None = Field(
        None, description="PEM file of the authority that signed the broker's certificate [default: the system's]"
    )
    certificate: Path | None = Field(None, description="PEM file of our certificate, for a broker that requires one")
    key: Path | None = Field(None, description="PEM file of its key")
    username: str | None = Field(None, description="our client identifier at the broker")
    password_file: Path | None = Field(None, description="file that contains only the password")
    topic: str = Field("springscale/{vehicle_id}", min_length=1, description="branch below which this vehicle reports")
    client_id: str | None = Field(None, min_length=1, description="[default: springscale- and the vehicle's id]")
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
    home_assistant: str | None = Field(
        None,
        min_length=1,
        description="appear in Home Assistant on this broker: its discovery prefix, which is `homeassistant` unless "
        "somebody changed it there",
    )

    @model_validator(mode="after")
    def _keeps_its_secrets(self) -> "UplinkSection":
        if (self.certificate is None) != (self.key is None):
            raise ValueError("certificate and key belong together: give both or neither")
        if self.password_file is not None and self.username is None:
            raise ValueError("password_file needs username")
        if self.password_file is not None and not self.tls and self.host not in {"127.0.0.1", "::1", "localhost"}:
            raise ValueError("a password would cross the network in the clear: set tls = true")
        return self


class BroadcastSection(SettingsSection):
    """Weights sent as J1939 frames onto another CAN bus than the one that the service listens to."""

    interface: str | None = Field(
        None, min_length=1, description="any python-can interface; without it nothing is ever sent on any bus"
    )
    channel: str | None = Field(None, min_length=1, description="its channel; never that of [bus]")
    options: dict[str, str | int | float | bool] = Field(
        default_factory=dict, description="further arguments of that python-can interface, e.g. bitrate"
    )
    source_address: int | None = Field(None, ge=0, le=253, description="J1939 source address, unique on that bus")
    priority: int = Field(6, ge=0, le=7, description="J1939 priority; 0 is the most urgent")
    every_s: float = Field(1.0, ge=0.1, le=3600.0, description="frames are sent so often")
    first_axle: int = Field(1, ge=0, le=1, description="number that the receivers expect of the front axle")
    draws_trailers: bool = Field(
        False, description="then the gross weight of the combination is unknown and is not sent"
    )

    @model_validator(mode="after")
    def _whole(self) -> "BroadcastSection":
        if self.interface is not None and (self.channel is None or self.source_address is None):
            raise ValueError("interface needs channel and source_address beside it")
        if self.interface is None and (self.channel is not None or self.source_address is not None):
            raise ValueError("nothing is sent without interface: give it, or leave out channel and source_address")
        return self
