"""Whether something of the vehicle may leave this machine: one rule for every channel, asked for every record.

HTTP, the event stream, MQTT, the webhook, the fleet's page and check-config ask here and nowhere else.
"""

import ipaddress
from enum import StrEnum


class Kind(StrEnum):
    """The kind of what would leave the vehicle."""

    RECORD = "record"  # a record without positions
    POSITION = "position"


class Encryption(StrEnum):
    """The way to the receiver."""

    LOCAL = "local"  # it ends on this machine
    TLS = "tls"
    NONE = "none"


class Holder(StrEnum):
    """Who would get it."""

    NOBODY = "nobody"  # nobody who is known: without a token although tokens exist, or with a revoked one
    MACHINE = "machine"  # whoever asks while no token exists
    NAMED = "named"  # a broker or a webhook that the settings name
    READ = "read"  # a token of this scope, as the next
    OPERATE = "operate"


def may_leave(kind: Kind, encryption: Encryption, holder: Holder, *, forward: bool = False) -> bool:
    """``forward`` is [position] forward: whether positions may go to those who only read."""
    if encryption is Encryption.NONE or holder is Holder.NOBODY:
        return False
    if holder is Holder.MACHINE and encryption is not Encryption.LOCAL:
        return False
    return kind is Kind.RECORD or forward or holder in (Holder.MACHINE, Holder.OPERATE)


def encryption_to(host: str, *, has_tls: bool) -> Encryption:
    """The way to an address or a name."""
    if is_loopback(host):
        return Encryption.LOCAL
    return Encryption.TLS if has_tls else Encryption.NONE


def is_loopback(host: str) -> bool:
    """Whether an address or name is this machine alone."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


LOCAL_NAMES = frozenset({"localhost", "127.0.0.1", "[::1]"})


def name_in(host: str) -> str:
    """The name in a Host header, without its port."""
    host = host.lower()
    return host if host.endswith("]") else host.rpartition(":")[0] or host
