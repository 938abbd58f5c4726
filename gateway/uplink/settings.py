"""Settings of the senders: the broker, and the webhook's receiver with its signing secrets."""

import base64
import hashlib
import ssl
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from gateway.config import VehicleSection
from gateway.config.sections import UplinkSection, WebhookSection
from gateway.errors import ConfigurationError

PREFIX: Final = "whsec_"
LEAST_BYTES: Final = 24  # Standard Webhooks 1.0.0: 24 to 64 bytes
MOST_BYTES: Final = 64  # likewise
HOW_TO_MAKE_ONE: Final = 'echo "whsec_$(openssl rand -base64 32)" > FILE'


class UplinkSettings(UplinkSection):
    """A broker and how to reach it: the section with its open choices made for this vehicle.

    ``topic`` is the branch of this vehicle: estimates go to ``topic/estimates``, presence is retained at
    ``topic/status``.
    """

    host: str
    port: int
    topic: str
    client_id: str

    @property
    def broker(self) -> str:
        """host:port, for people."""
        return f"{self.host}:{self.port}"

    @property
    def queue(self) -> str:
        """Name of the queue position. It belongs to the receiver: another broker or topic starts from the beginning."""
        return f"mqtt://{self.broker}/{self.topic}"

    def tls_context(self) -> ssl.SSLContext | None:
        """Checks the broker's certificate and name. Raises ConfigurationError for files that cannot be used."""
        return _tls_context("[uplink] TLS files", self.ca, self.certificate, self.key) if self.tls else None

    def password(self) -> str | None:
        """The password, read at every connection, so that it can be changed while the service runs.

        Raises ConfigurationError if the file cannot be read.
        """
        if self.password_file is None:
            return None
        try:
            return self.password_file.read_text(encoding="utf-8").strip()
        except (OSError, UnicodeDecodeError) as fault:
            raise ConfigurationError(f"[uplink] password_file {self.password_file} cannot be read: {fault}") from None


def uplink_settings(section: UplinkSection, vehicle: VehicleSection) -> UplinkSettings | None:
    """The settings of [uplink] for this vehicle; None without a host.

    Raises ConfigurationError for a name that MQTT forbids, and if the vehicle still has the default id.
    """
    if section.host is None:
        return None
    topic = section.topic.replace("{vehicle_id}", vehicle.id)
    for key, told in (("topic", topic), ("home_assistant", section.home_assistant or "")):
        if {*told} & {*"+#\0"} or told.startswith("$"):
            raise ConfigurationError(
                f"[uplink] {key} {told!r}: MQTT allows no +, # or NUL in a topic, nor a $ before it"
            )
    settings = UplinkSettings(
        **section.model_dump(exclude={"port", "topic", "client_id"}),
        port=section.port if section.port is not None else (8883 if section.tls else 1883),
        topic=topic,
        client_id=section.client_id or f"springscale-{vehicle.id}",
    )
    settings.tls_context()  # a wrong file is reported at the start
    settings.password()
    require_own_id("[uplink] host", vehicle, "two of them would cut each other's link")
    return settings


def require_own_id(key: str, vehicle: VehicleSection, why: str) -> None:
    """Raises ConfigurationError if ``key`` makes the vehicle send while it has the default id."""
    if vehicle.id == VehicleSection().id:
        raise ConfigurationError(
            f"{key} is set, but [vehicle] id is {vehicle.id!r}, the default of every vehicle: "
            f"{why}; set [vehicle] id to a unique name"
        )


def _tls_context(
    where: str, ca: Path | None, certificate: Path | None = None, key: Path | None = None
) -> ssl.SSLContext:
    try:
        context = ssl.create_default_context(cafile=ca)
        if certificate is not None:
            context.load_cert_chain(certificate, key)
    except OSError as fault:  # ssl.SSLError is one
        names = ", ".join(str(path) for path in (ca, certificate, key) if path is not None)
        raise ConfigurationError(f"{where} {names} cannot be used: {fault}") from None
    return context


class WebhookSettings(WebhookSection):
    """Where to push, and with what: the section with its address and its secret."""

    url: str
    secret_file: Path

    @property
    def kinds(self) -> tuple[str, ...]:
        """The webhook types to send."""
        return tuple(kind.removesuffix("s") for kind in self.send)

    @property
    def receiver(self) -> str:
        """The address for people, without the path, which may contain a secret."""
        parts = urlsplit(self.url)
        host = f"[{parts.hostname}]" if ":" in (parts.hostname or "") else parts.hostname
        return f"{parts.scheme}://{host}:{parts.port or (443 if parts.scheme == 'https' else 80)}"

    @property
    def queue(self) -> str:
        """Name of the queue position. It belongs to the address: a new address starts at the first record."""
        parts = urlsplit(self.url)
        path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        return f"{self.receiver}#{hashlib.sha256(path.encode()).hexdigest()[:12]}"

    def secrets(self) -> tuple[bytes, ...]:
        """The secrets, read for every attempt, so that they can be changed while the service runs.

        Raises ConfigurationError if the file cannot be used.
        """
        try:
            return secrets_of(self.secret_file.read_text(encoding="utf-8"))
        except (OSError, ValueError) as fault:  # UnicodeDecodeError is one
            told = f"{self.secret_file} cannot be used: {fault}; one is made by {HOW_TO_MAKE_ONE}"
            raise ConfigurationError(f"[webhook] secret_file {told}") from None

    def tls_context(self) -> ssl.SSLContext | None:
        """Checks the receiver's certificate and name. Raises ConfigurationError for a file that cannot be used."""
        return _tls_context("[webhook] ca", self.ca) if self.url.startswith("https:") else None


def webhook_settings(section: WebhookSection, vehicle: VehicleSection) -> WebhookSettings | None:
    """The settings of [webhook]; None without a url. Raises ConfigurationError for files that cannot be used."""
    if section.url is None:
        return None
    settings = WebhookSettings(**section.model_dump())
    settings.tls_context()  # a wrong file is reported at the start
    settings.secrets()
    require_own_id("[webhook] url", vehicle, "a receiver could not tell them apart")
    return settings


def secrets_of(text: str) -> tuple[bytes, ...]:
    """One secret per line, the current one first; older ones sign too during a change-over.

    Raises ValueError for a text that is no secret to sign with.
    """
    found = tuple(_secret(line.strip()) for line in text.splitlines() if line.strip())
    if not found:
        raise ValueError("is empty")
    return found


def _secret(line: str) -> bytes:
    try:
        secret = base64.b64decode(line.removeprefix(PREFIX), validate=True)
    except ValueError:  # binascii.Error is one
        raise ValueError(f"is not {PREFIX} and base64") from None
    if not LEAST_BYTES <= len(secret) <= MOST_BYTES:
        raise ValueError(f"holds {len(secret)} bytes, {LEAST_BYTES} to {MOST_BYTES} are allowed")
    return secret
