"""Bearer tokens: shown once, kept as hashes, revoked without a restart."""

import hashlib
import hmac
import json
import logging
import os
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gateway.errors import ConfigurationError
from gateway.log import Event, log_event

_PREFIX: Final = "spr"  # lets secret scanners recognise a token that leaked


class Scope(StrEnum):
    """What a token is good for."""

    READ = "read"
    OPERATE = "operate"

    def allows(self, wanted: "Scope") -> bool:
        """Who may operate may read."""
        return self is Scope.OPERATE or wanted is Scope.READ


class Token(BaseModel):
    """A token as it is kept: its secret cannot be told from it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str
    name: str
    scope: Scope
    sha256: str = Field(repr=False)
    created_s: int
    expires_s: int | None = None

    def is_expired(self, now_s: float) -> bool:
        return self.expires_s is not None and now_s >= self.expires_s

    def expiry(self) -> str:
        """When it ends, for people."""
        return "never" if self.expires_s is None else f"{datetime.fromtimestamp(self.expires_s, UTC):%Y-%m-%dT%H:%MZ}"


class _Content(BaseModel):
    model_config = ConfigDict(extra="forbid")

    format: Literal["springscale-tokens"] = "springscale-tokens"
    version: Literal[1] = 1
    tokens: tuple[Token, ...] = ()


@dataclass(frozen=True, slots=True)
class _Read:
    """The file as it was when last read."""

    stamp: tuple[int, int, int] | None
    by_id: dict[str, Token]


class TokenFile:
    """The tokens of one service. The command line writes the file; the service follows its changes.

    A secret has 256 random bits, so its plain SHA-256 is as good as a slow hash and costs a request
    nothing.
    """

    def __init__(self, path: Path, clock_s: Callable[[], float] = time.time) -> None:
        self._path = path
        self._clock_s = clock_s
        self._read = _Read(None, {})

    def create(self, name: str, scope: Scope, lifetime_s: float | None = None) -> str:
        """A new token, to be shown this once. Raises ConfigurationError where the name is taken."""
        tokens = self.tokens()
        if any(token.name == name for token in tokens):
            raise ConfigurationError(f"{self._path}: there is a token {name!r} already: revoke it or take another name")
        token_id, secret, now_s = secrets.token_hex(4), secrets.token_urlsafe(32), int(self._clock_s())
        made = Token(
            id=token_id,
            name=name,
            scope=scope,
            sha256=_hashed(secret),
            created_s=now_s,
            expires_s=None if lifetime_s is None else now_s + int(lifetime_s),
        )
        self._write((*tokens, made))
        return f"{_PREFIX}_{token_id}_{secret}"

    def revoke(self, name: str) -> None:
        """Forget the token of this name or id. Raises ConfigurationError where there is none."""
        tokens = self.tokens()
        kept = tuple(token for token in tokens if name not in (token.name, token.id))
        if len(kept) == len(tokens):
            raise ConfigurationError(f"{self._path}: there is no token {name!r}: `springscale token list` shows them")
        self._write(kept)

    def tokens(self) -> tuple[Token, ...]:
        """All tokens, oldest first. Raises ConfigurationError for a file that cannot be read."""
        try:
            return _Content.model_validate_json(self._path.read_bytes()).tokens
        except FileNotFoundError:
            return ()
        except (OSError, ValidationError) as fault:
            raise ConfigurationError(f"{self._path} is no token file: {fault}") from None

    def verify(self, text: str) -> Token | None:
        """The token this text is, None for any other text, or one that is revoked or expired."""
        prefix, _, rest = text.partition("_")
        token_id, _, secret = rest.partition("_")
        token = self._known().get(token_id)
        expected = _hashed("") if token is None else token.sha256
        is_same = hmac.compare_digest(_hashed(secret), expected)  # as long for a wrong id as for a wrong secret
        is_valid = is_same and prefix == _PREFIX and token is not None and not token.is_expired(self._clock_s())
        return token if is_valid else None

    def _known(self) -> dict[str, Token]:
        """The tokens by id, read again whenever the file has changed. An unreadable file lets nobody in."""
        stamp = self._stamp()
        if stamp != self._read.stamp:
            try:
                self._read = _Read(stamp, {token.id: token for token in self.tokens()})
            except ConfigurationError as fault:
                log_event(Event.TOKENS_UNREADABLE, level=logging.ERROR, fault=str(fault))
                self._read = _Read(stamp, {})
        return self._read.by_id

    def _stamp(self) -> tuple[int, int, int] | None:
        try:
            status = self._path.stat()
        except OSError:
            return None
        return status.st_ino, status.st_mtime_ns, status.st_size

    def _write(self, tokens: tuple[Token, ...]) -> None:
        """Replace the file in one step, readable by its owner alone.

        The owner is the directory's: an administrator makes tokens as root, the service reads them as itself.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        fresh = self._path.with_name(f".{self._path.name}.{os.getpid()}")
        descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(descriptor, "w") as file:
            if os.geteuid() == 0:
                owner = self._path.parent.stat()
                os.fchown(file.fileno(), owner.st_uid, owner.st_gid)
            file.write(json.dumps(_Content(tokens=tokens).model_dump(mode="json"), indent=1) + "\n")
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(self._path)


def _hashed(secret: str) -> str:
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).hexdigest()
