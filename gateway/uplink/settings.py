"""Settings of the connection to the broker."""

import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gateway.config import VehicleSection
from gateway.config.outward import UplinkSection
from gateway.errors import ConfigurationError

MOST_NAME_BYTES: Final = 65_535


@dataclass(frozen=True, slots=True)
class UplinkSettings:
    """A broker and how to reach it.

    ``topic`` is the branch of this vehicle: estimates go to ``topic/estimates``, presence is retained at
    ``topic/status``. ``ca`` is the authority that must have signed the broker's certificate; None: those of the system.
    ``certificate`` and ``key`` are the client's, if the broker requires them.
    """

    host: str
    port: int
    topic: str
    client_id: str
    tls: bool = True
    ca: Path | None = None
    certificate: Path | None = None
    key: Path | None = None
    username: str | None = None
    password_file: Path | None = None
    keep_alive_s: int = 60
    back_off_max_s: float = 300.0
    repeat_s: float = 0.0
    wait_for_listener: bool = False
    home_assistant: str | None = None

    @property
    def broker(self) -> str:
        """host:port, for people."""
        return f"{self.host}:{self.port}"

    def tls_context(self) -> ssl.SSLContext | None:
        """Checks the broker's certificate and name. Raises ConfigurationError for files that cannot be used."""
        if not self.tls:
            return None
        try:
            context = ssl.create_default_context(cafile=self.ca)
            if self.certificate is not None:
                context.load_cert_chain(self.certificate, self.key)
        except OSError as fault:  # ssl.SSLError is one
            names = ", ".join(str(path) for path in (self.ca, self.certificate, self.key) if path is not None)
            raise ConfigurationError(f"[uplink] TLS files {names} cannot be used: {fault}") from None
        return context

    def password(self) -> str | None:
        """The password, read at every connection, so that it can be changed while the service runs.

        Raises ConfigurationError if the file cannot be read.
        """
        if self.password_file is None:
            return None
        try:
            password = self.password_file.read_text(encoding="utf-8").strip()
        except (OSError, UnicodeDecodeError) as fault:
            raise ConfigurationError(f"[uplink] password_file {self.password_file} cannot be read: {fault}") from None
        _check_name("password_file's password", password)
        return password


def uplink_settings(section: UplinkSection, vehicle: VehicleSection) -> UplinkSettings | None:
    """The settings of [uplink] for this vehicle; None without a host.

    Raises ConfigurationError for a name that MQTT forbids, and if the vehicle still has the default id.
    """
    if section.host is None:
        return None
    topic = section.topic.replace("{vehicle_id}", vehicle.id)
    if any(character in topic for character in "+#\0") or topic.startswith("$"):
        raise ConfigurationError(
            f"[uplink] topic {topic!r}: MQTT allows no +, # or NUL in a topic, nor a $ before it: "
            "set [uplink] topic without {vehicle_id}, or another [vehicle] id"
        )
    settings = UplinkSettings(
        **section.model_dump(exclude={"port", "topic", "client_id"}),
        port=section.port if section.port is not None else (8883 if section.tls else 1883),
        topic=topic,
        client_id=section.client_id or f"springscale-{vehicle.id}",
    )
    if any(character in (section.home_assistant or "") for character in "+#\0"):
        raise ConfigurationError(
            f"[uplink] home_assistant {section.home_assistant!r}: MQTT allows no +, # or NUL there"
        )
    names = {"topic": f"{topic}/estimates", "client_id": settings.client_id, "username": settings.username}
    for name, text in names.items():
        _check_name(name, text)
    settings.tls_context()  # a wrong file is told at the start
    settings.password()
    require_own_id("[uplink] host", vehicle, "two of them would cut each other's link")
    return settings


def require_own_id(key: str, vehicle: VehicleSection, why: str) -> None:
    """Raises ConfigurationError if ``key`` makes the vehicle send while it has the default id."""
    if vehicle.id == VehicleSection().id:
        raise ConfigurationError(
            f"{key} is set, but [vehicle] id is {vehicle.id!r}, that of every vehicle that was given none: "
            f"{why}; set [vehicle] id to a name of its own"
        )


def _check_name(name: str, text: str | None) -> None:
    """MQTT writes the length of a name in two bytes, and the name in UTF-8 (MQTT 5, 1.5.4)."""
    try:
        n_bytes = len((text or "").encode())
    except UnicodeEncodeError:
        raise ConfigurationError(f"[uplink] {name} is no text that UTF-8 can hold") from None
    if n_bytes > MOST_NAME_BYTES:
        raise ConfigurationError(f"[uplink] {name} has {n_bytes} bytes, MQTT allows {MOST_NAME_BYTES}: make it shorter")
