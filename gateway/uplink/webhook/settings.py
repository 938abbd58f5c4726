"""Settings of the webhook: the receiver, the record types it gets, and the signing secrets."""

import hashlib
import ssl
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

from gateway.config import VehicleSection
from gateway.config.alarms import WebhookSection
from gateway.errors import ConfigurationError
from gateway.uplink.settings import require_own_id
from gateway.uplink.webhook.signature import SecretError, secrets_of

HOW_TO_MAKE_ONE = 'echo "whsec_$(openssl rand -base64 32)" > FILE'


@dataclass(frozen=True, slots=True)
class WebhookSettings:
    """The address in its parts; ``path`` includes the query. ``kinds`` are the webhook types to send."""

    is_tls: bool
    host: str
    port: int
    path: str
    secret_file: Path
    kinds: tuple[str, ...]
    ca: Path | None = None
    timeout_s: float = 20.0
    back_off_max_s: float = 300.0
    give_up_s: float = 72 * 3600.0

    @property
    def receiver(self) -> str:
        """The address for people, without the path, which may contain a secret."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'https' if self.is_tls else 'http'}://{host}:{self.port}"

    @property
    def queue(self) -> str:
        """Name of the queue position. It belongs to the address: a new address starts at the first record."""
        return f"{self.receiver}#{hashlib.sha256(self.path.encode()).hexdigest()[:12]}"

    def secrets(self) -> tuple[bytes, ...]:
        """The secrets, read for every attempt, so that they can be changed while the service runs.

        Raises ConfigurationError if the file cannot be used.
        """
        try:
            return secrets_of(self.secret_file.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, SecretError) as fault:
            raise ConfigurationError(
                f"[webhook] secret_file {self.secret_file} cannot be used: {fault}; one is made by {HOW_TO_MAKE_ONE}"
            ) from None

    def tls_context(self) -> ssl.SSLContext | None:
        """Checks the receiver's certificate and name. Raises ConfigurationError for a file that cannot be used."""
        if not self.is_tls:
            return None
        try:
            return ssl.create_default_context(cafile=self.ca)
        except OSError as fault:  # ssl.SSLError is one
            raise ConfigurationError(f"[webhook] ca {self.ca} cannot be used: {fault}") from None


def webhook_settings(section: WebhookSection, vehicle: VehicleSection) -> WebhookSettings | None:
    """The settings of [webhook]; None without a url. Raises ConfigurationError for files that cannot be used."""
    if section.url is None or section.secret_file is None:  # the section asks for both
        return None
    url = urlsplit(section.url)
    is_tls = url.scheme == "https"
    settings = WebhookSettings(
        is_tls=is_tls,
        host=url.hostname or "",
        port=url.port or (443 if is_tls else 80),
        path=(url.path or "/") + (f"?{url.query}" if url.query else ""),
        secret_file=section.secret_file,
        kinds=tuple(kind.removesuffix("s") for kind in section.send),
        ca=section.ca,
        timeout_s=section.timeout_s,
        back_off_max_s=section.back_off_max_s,
        give_up_s=3600.0 * section.give_up_h,
    )
    settings.tls_context()  # a wrong file is told at the start
    settings.secrets()
    require_own_id("[webhook] url", vehicle, "a receiver could not tell them apart")
    return settings
