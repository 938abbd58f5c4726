"""Bearer tokens: shown once, kept as hashes, revoked without a restart."""

import hashlib
import hmac
import json
import logging
import secrets
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from gateway.errors import ConfigurationError
from gateway.files.owned import KeptFiles
from gateway.log import Event, log_event

_PREFIX: Final = "spr"  # lets secret scanners recognise a token that leaked
MOST_NAME: Final = 64  # chosen: characters


def _named(name: str) -> str:
    """A name that a terminal, the journal and the file can show unchanged."""
    if not name or len(name) > MOST_NAME or not name.isprintable() or name != name.strip():
        raise ValueError(f"a token's name has 1 to {MOST_NAME} printable characters and no blank at either end")
    return name


class Scope(StrEnum):
    READ = "read"
    OPERATE = "operate"

    def allows(self, wanted: "Scope") -> bool:
        """Scope operate includes read."""
        return self is Scope.OPERATE or wanted is Scope.READ


class Token(BaseModel):
    """A token as stored: the secret cannot be recovered from it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str
    name: Annotated[str, AfterValidator(_named)]
    scope: Scope
    sha256: str = Field(repr=False)
    created_s: int
    expires_s: int | None = None

    def is_expired(self, now_s: float) -> bool:
        """True also if the clock is before the token's creation: such a clock was never set, and cannot judge an
        age.
        """
        return self.expires_s is not None and not self.created_s <= now_s < self.expires_s

    def expiry(self) -> str:
        return "never" if self.expires_s is None else f"{datetime.fromtimestamp(self.expires_s, UTC):%Y-%m-%dT%H:%MZ}"


class _Content(BaseModel):
    model_config = ConfigDict(extra="forbid")

    format: Literal["springscale-tokens"] = "springscale-tokens"
    version: Literal[1] = 1
    tokens: tuple[Token, ...] = ()


_Stamp = tuple[int, int, int] | None


class TokenFile:
    """The tokens of one service. The command line writes the file; the service follows its changes.

    A secret has 256 random bits, so its plain SHA-256 is as good as a slow hash and costs almost nothing per request.
    """

    def __init__(self, path: Path, clock_s: Callable[[], float] = time.time) -> None:
        self._path = path
        self._files = KeptFiles(path.parent)
        self._clock_s = clock_s
        self._stamp: _Stamp = None  # of the file as last read
        self._known: dict[str, Token] = {}  # the tokens by id, as last read
        self._is_closed = False  # whether a token is required
        self.fault: str | None = None  # why no token is accepted, for the status

    def create(self, name: str, scope: Scope, lifetime_s: float | None = None) -> str:
        """A new token, to be shown this once. Raises ConfigurationError if the name is taken or invalid."""
        try:
            _named(name)
        except ValueError as fault:
            raise ConfigurationError(f"{name!r}: {fault}") from None
        with self._alone():
            tokens = self.tokens()
            if any(token.name == name for token in tokens):
                raise ConfigurationError(
                    f"{self._path}: there is a token {name!r} already: revoke it or take another name"
                )
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
        """Forget the token of this name or id. Raises ConfigurationError if there is none."""
        with self._alone():
            tokens = self.tokens()
            kept = tuple(token for token in tokens if name not in (token.name, token.id))
            if len(kept) == len(tokens):
                raise ConfigurationError(
                    f"{self._path}: there is no token {name!r}: `springscale token list --config FILE` shows them"
                )
            self._write(kept)

    def tokens(self) -> tuple[Token, ...]:
        """All tokens, oldest first. Raises ConfigurationError for a file that cannot be read."""
        try:
            return _Content.model_validate_json(self._files.read(self._path.name)).tokens
        except FileNotFoundError:
            return ()
        except (OSError, ValidationError) as fault:
            why = fault.errors()[0]["msg"] if isinstance(fault, ValidationError) else fault
            raise ConfigurationError(
                f"{self._path} is no token file ({why}): move it away, then make new tokens with "
                "`springscale token create NAME --config FILE`"
            ) from None

    def are_required(self) -> bool:
        """Whether requests need a token; fast enough for every request, since it reads the file only after a change.

        A file without tokens requires none. A broken file requires one and accepts none, and so does a file that
        disappears while tokens are in use: breaking it must not open the API to all of this machine.
        """
        self._follow()
        return self._is_closed

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Hold the lock of the file, from reading it to writing it."""
        try:
            with self._files.locked():
                yield
        except OSError as fault:  # a lock that is not let go is a TimeoutError, which is one
            raise ConfigurationError(f"{self._path} cannot be changed: {fault}") from None

    def verify(self, text: str) -> Token | None:
        """The token of this text; None for any other text, or one that is revoked or expired."""
        prefix, _, rest = text.partition("_")
        token_id, _, secret = rest.partition("_")
        self._follow()
        token = self._known.get(token_id)
        expected = _hashed("") if token is None else token.sha256
        is_same = hmac.compare_digest(_hashed(secret), expected)  # as long for a wrong id as for a wrong secret
        is_valid = is_same and prefix == _PREFIX and token is not None and not token.is_expired(self._clock_s())
        return token if is_valid else None

    def _follow(self) -> None:
        """Read the tokens again if the file has changed."""
        stamp = self._files.stamp(self._path.name)
        if stamp is None and not self._is_closed:
            return
        if stamp == self._stamp and (stamp is not None or self.fault is not None):
            return
        self._stamp, self._known, self.fault = stamp, {}, None
        try:
            self._known = {token.id: token for token in self.tokens()}
        except ConfigurationError as broken:
            self.fault = f"no token is accepted: {broken}"
        else:
            if stamp is None:
                self.fault = f"{self._path} has gone while tokens were in use: no token is accepted"
        if self.fault is not None:
            log_event(Event.TOKENS_UNREADABLE, level=logging.ERROR, fault=self.fault)
        self._is_closed = self.fault is not None or bool(self._known)

    def _write(self, tokens: tuple[Token, ...]) -> None:
        """Replace the file in one step, readable by its owner alone."""
        text = json.dumps(_Content(tokens=tokens).model_dump(mode="json"), indent=1) + "\n"
        self._files.write(self._path.name, text.encode())


def _hashed(secret: str) -> str:
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).hexdigest()
