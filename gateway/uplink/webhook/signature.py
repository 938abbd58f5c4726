"""Signature of a webhook request: HMAC-SHA256 over id, time of the attempt and body.

Standard Webhooks 1.0.0 (standard-webhooks/spec), "Signature scheme" and "Webhook headers".
"""

import base64
import binascii
import hashlib
import hmac
from collections.abc import Sequence
from typing import Final

PREFIX: Final = "whsec_"
LEAST_BYTES: Final = 24
MOST_BYTES: Final = 64


class SecretError(ValueError):
    """The text is no secret to sign with."""


def secrets_of(text: str) -> tuple[bytes, ...]:
    """One secret per line, the current one first; older ones sign too during a change-over. Raises SecretError."""
    found = tuple(_secret(line.strip()) for line in text.splitlines() if line.strip())
    if not found:
        raise SecretError("is empty")
    return found


def signed(secrets: Sequence[bytes], letter_id: str, t_s: int, body: bytes) -> dict[str, str]:
    """The headers of one attempt at ``t_s`` (Unix seconds); a retry has the same id and another time."""
    content = f"{letter_id}.{t_s}.".encode() + body
    marks = (base64.b64encode(hmac.digest(secret, content, hashlib.sha256)).decode() for secret in secrets)
    return {
        "webhook-id": letter_id,
        "webhook-timestamp": str(t_s),
        "webhook-signature": " ".join(f"v1,{mark}" for mark in marks),
    }


def _secret(line: str) -> bytes:
    try:
        secret = base64.b64decode(line.removeprefix(PREFIX), validate=True)
    except (binascii.Error, ValueError):
        raise SecretError(f"is not {PREFIX} and base64") from None
    if not LEAST_BYTES <= len(secret) <= MOST_BYTES:
        raise SecretError(f"holds {len(secret)} bytes, {LEAST_BYTES} to {MOST_BYTES} are allowed")
    return secret
