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
from gateway.files.kept import KeptFiles
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
        self._read: tuple[_Stamp, dict[str, Token]] = (None, {})  # the tokens by id, as last read
        self._asked_at: tuple[_Stamp, bool] | None = None  # whether a token was required in this state of the file
        self.fault: str | None = None  # why no token is accepted, for the status

    def create(self, name: str, scope: Scope, lifetime_s: float | None = None) -> str:
        """A new token, to be shown this once. Raises ConfigurationError if the name is taken or invalid.

        A broken file is first set aside and reported; the next try begins a new one.
        """
        try:
            _named(name)
        except ValueError as fault:
            raise ConfigurationError(f"{name!r}: {fault}") from None
        with self._alone():
            tokens = self._tokens_or_set_aside()
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
            raise ConfigurationError(f"{self._path} is no token file: {fault}") from None

    def are_in_use(self) -> bool:
        """Whether a token is required, by the present file; a broken one is set aside here and reported in ``fault``.

        A broken file denies access, and its absence keeps it denied: breaking it must not open the API to all of this
        machine.
        """
        try:
            tokens = self._tokens_or_set_aside()
        except ConfigurationError as broken:
            self.fault = str(broken)
            return True
        earlier = self._files.set_aside_earlier(self._path.name)
        if earlier and self._files.stamp(self._path.name) is None:
            self.fault = (
                f"{self._path} was broken and is now {earlier[-1]}: no token is accepted until "
                "`springscale token create NAME --config FILE` has made new ones, or that file is moved away"
            )
            return True
        return bool(tokens)

    def are_required(self) -> bool:
        """Whether requests need a token; fast enough for every request, since it reads the file only after a change.

        A file without tokens requires none. If the file disappears while tokens are in use, a token is still required.
        """
        stamp = self._files.stamp(self._path.name)
        if self._asked_at is not None and stamp == self._asked_at[0]:
            return self._asked_at[1]
        was_asked = self._asked_at is not None and self._asked_at[1]
        if stamp is None and was_asked:
            self.fault = self.fault or f"{self._path} has gone while tokens were in use: no token is accepted"
            are_in_use = True
        else:
            are_in_use = self.are_in_use()
        self._asked_at = (self._files.stamp(self._path.name), are_in_use)
        return are_in_use

    def _tokens_or_set_aside(self) -> tuple[Token, ...]:
        """The tokens. Raises ConfigurationError that says where the broken file is now."""
        try:
            return self.tokens()
        except ConfigurationError as fault:
            broken = str(fault)
        try:
            aside = f"set aside as {self._files.set_aside(self._path.name)}"
        except OSError as refusal:
            aside = f"and cannot be set aside: {refusal}"
        log_event(Event.TOKENS_SET_ASIDE, level=logging.ERROR, fault=broken, set_aside=aside)
        raise ConfigurationError(f"{broken}; {aside}: `springscale token create NAME --config FILE` begins a new one")

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
        token = self._known().get(token_id)
        expected = _hashed("") if token is None else token.sha256
        is_same = hmac.compare_digest(_hashed(secret), expected)  # as long for a wrong id as for a wrong secret
        is_valid = is_same and prefix == _PREFIX and token is not None and not token.is_expired(self._clock_s())
        return token if is_valid else None

    def _known(self) -> dict[str, Token]:
        """The tokens by id, read again whenever the file has changed. An unreadable file accepts no token."""
        stamp = self._files.stamp(self._path.name)
        if stamp != self._read[0]:
            try:
                self._read = (stamp, {token.id: token for token in self.tokens()})
                self.fault = None if self._read[1] else self.fault
            except ConfigurationError as fault:
                log_event(Event.TOKENS_UNREADABLE, level=logging.ERROR, fault=str(fault))
                self._read = (stamp, {})
                self.fault = f"no token is accepted: {fault}"
        return self._read[1]

    def _write(self, tokens: tuple[Token, ...]) -> None:
        """Replace the file in one step, readable by its owner alone."""
        text = json.dumps(_Content(tokens=tokens).model_dump(mode="json"), indent=1) + "\n"
        self._files.write(self._path.name, text.encode())


def _hashed(secret: str) -> str:
    return hashlib.sha256(secret.encode("utf-8", "surrogateescape")).hexdigest()
