"""Who is answered: with tokens, whoever shows a valid one; without tokens, only this machine."""

from dataclasses import dataclass
from typing import Annotated, Final

from fastapi import HTTPException, Request, Security
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer

from gateway.config.permission import LOCAL_NAMES, Encryption, Holder, Kind, is_loopback, may_leave, name_in
from gateway.estimates.field_kinds import without_places
from gateway.web.access.tokens import Scope, Token, TokenFile

_SAFE_METHODS: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_FORWARDED: Final = ("forwarded", "via", "x-forwarded-for", "x-forwarded-host", "x-forwarded-proto", "x-real-ip")
_CHALLENGE: Final = 'Bearer realm="springscale"'
HOW_TO_MAKE_ONE: Final = "`springscale token create NAME --config springscale.toml` on the gateway"

bearer: Final = HTTPBearer(auto_error=False, description=f"Needed as soon as one token exists: {HOW_TO_MAKE_ONE}")


@dataclass(frozen=True, slots=True)
class Client:
    """Who asks, from where, with which text for a token; its rights are looked up anew for each record."""

    tokens: TokenFile | None
    text: str
    encryption: Encryption
    forward: bool = False

    def known_as(self) -> tuple[Holder, Token | None]:
        """Who it is now, and the valid token that it shows."""
        if self.tokens is None or not self.tokens.are_required():  # the first token counts from its first moment
            return Holder.MACHINE, None
        token = self.tokens.verify(self.text)
        return (Holder.NOBODY if token is None else Holder(token.scope)), token

    def shown(self, record: str) -> str:
        """The JSON of a record as this client may see it. Raises PermissionError if it may see no record any more."""
        holder, _ = self.known_as()
        if not may_leave(Kind.RECORD, self.encryption, holder):
            raise PermissionError("the token was revoked or has expired, or one is needed now")
        is_whole = may_leave(Kind.POSITION, self.encryption, holder, forward=self.forward)
        return record if is_whole else without_places(record)


class Access:
    """The dependency of every route that tells something of the vehicle. Raises HTTPException for a refusal."""

    def __init__(self, tokens: TokenFile | None, *, are_places_read: bool = False) -> None:
        """``are_places_read`` is whether a token with scope read gets positions."""
        self._tokens = tokens
        self._are_places_read = are_places_read

    async def __call__(
        self, request: Request, shown: Annotated[HTTPAuthorizationCredentials | None, Security(bearer)]
    ) -> None:
        """Leaves the client in ``request.state.client``, and its token's name in ``token_name``."""
        text = "" if shown is None else shown.credentials.strip()
        client = Client(self._tokens, text, _encryption(request), forward=self._are_places_read)
        request.state.client = client
        holder, token = client.known_as()
        if holder is Holder.MACHINE:
            _refuse_strangers(request, client.encryption)
            return
        if token is None:
            is_shown = "authorization" in request.headers
            detail = (
                "this token is not known, revoked or expired"
                if is_shown
                else f"a bearer token is needed: {HOW_TO_MAKE_ONE} makes one"
            )
            challenge = f'{_CHALLENGE}, error="invalid_token"' if is_shown else _CHALLENGE
            raise HTTPException(401, detail, {"www-authenticate": challenge})
        if not may_leave(Kind.RECORD, client.encryption, holder):
            raise HTTPException(403, "over plain HTTP only this machine is answered: use https")
        request.state.token_name = token.name
        wanted = Scope.READ if request.method in _SAFE_METHODS else Scope.OPERATE
        if not token.scope.allows(wanted):
            challenge = f'{_CHALLENGE}, error="insufficient_scope", scope="{wanted}"'
            raise HTTPException(403, f"this needs a token with scope {wanted}", {"www-authenticate": challenge})


def _encryption(request: Request) -> Encryption:
    """The way to whoever asks. A proxy on this machine is trusted to encrypt."""
    if request.client is None or is_loopback(request.client.host):
        is_proxied = any(name in request.headers for name in _FORWARDED)
        return Encryption.TLS if is_proxied else Encryption.LOCAL
    return Encryption.TLS if request.url.scheme == "https" else Encryption.NONE


def _refuse_strangers(request: Request, encryption: Encryption) -> None:
    """Answers without tokens only this machine, and only under a local name (else a web page could use DNS tricks)."""
    if not may_leave(Kind.RECORD, encryption, Holder.MACHINE):  # a proxy is local, its clients are not
        raise HTTPException(
            403, f"without tokens only this machine is answered, and through no proxy: {HOW_TO_MAKE_ONE} makes one"
        )
    host = request.headers.get("host", "")
    if name_in(host) not in LOCAL_NAMES:
        raise HTTPException(421, f"without tokens only {', '.join(sorted(LOCAL_NAMES))} are answered for")
    origin = request.headers.get("origin")
    is_from_here = origin is None or origin.lower().partition("://")[2] == host.lower()
    if request.method not in _SAFE_METHODS and not is_from_here:
        raise HTTPException(403, "without tokens a page from elsewhere may not change anything")
