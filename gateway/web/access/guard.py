"""Who is answered: with tokens, whoever shows a valid one; without tokens, only this machine."""

import ipaddress
from typing import Annotated, Final

from fastapi import HTTPException, Request, Security
from fastapi.security import HTTPAuthorizationCredentials, HTTPBearer

from gateway.web.access.tokens import Scope, TokenFile

_SAFE_METHODS: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_FORWARDED: Final = ("forwarded", "via", "x-forwarded-for", "x-forwarded-host", "x-forwarded-proto", "x-real-ip")
_LOCAL_NAMES: Final = frozenset({"localhost", "127.0.0.1", "[::1]"})
_CHALLENGE: Final = 'Bearer realm="springscale"'
HOW_TO_MAKE_ONE: Final = "`springscale token create NAME --config springscale.toml` on the gateway"

bearer: Final = HTTPBearer(auto_error=False, description=f"Needed as soon as one token exists: {HOW_TO_MAKE_ONE}")


class Access:
    """The dependency of every route that tells something of the vehicle. Raises HTTPException for a refusal."""

    def __init__(self, tokens: TokenFile | None, *, are_places_read: bool = False) -> None:
        """``are_places_read`` is whether a token with scope read gets positions."""
        self._tokens = tokens
        self._are_places_read = are_places_read

    async def __call__(
        self, request: Request, shown: Annotated[HTTPAuthorizationCredentials | None, Security(bearer)]
    ) -> None:
        """Leaves the token's name in ``request.state.token_name``, and whether it gets no positions in
        ``hides_places``.
        """
        if self._tokens is None or not self._tokens.are_required():  # the first token counts from its first moment
            _refuse_strangers(request)
            return
        token = None if shown is None else self._tokens.verify(shown.credentials.strip())
        if token is None:
            is_shown = "authorization" in request.headers
            detail = (
                "this token is not known, revoked or expired"
                if is_shown
                else f"a bearer token is needed: {HOW_TO_MAKE_ONE} makes one"
            )
            challenge = f'{_CHALLENGE}, error="invalid_token"' if is_shown else _CHALLENGE
            raise HTTPException(401, detail, {"www-authenticate": challenge})
        request.state.token_name = token.name
        request.state.hides_places = token.scope is Scope.READ and not self._are_places_read
        wanted = Scope.READ if request.method in _SAFE_METHODS else Scope.OPERATE
        if not token.scope.allows(wanted):
            challenge = f'{_CHALLENGE}, error="insufficient_scope", scope="{wanted}"'
            raise HTTPException(403, f"this needs a token with scope {wanted}", {"www-authenticate": challenge})


def _refuse_strangers(request: Request) -> None:
    """Without tokens: only from this machine, and only under a local name (else a web page could ask by DNS tricks)."""
    if request.client is not None and not is_loopback(request.client.host):
        raise HTTPException(403, f"without tokens only this machine is answered: {HOW_TO_MAKE_ONE} makes one")
    if any(name in request.headers for name in _FORWARDED):  # the proxy is local, its clients are not
        raise HTTPException(403, f"without tokens nobody is answered through a proxy: {HOW_TO_MAKE_ONE} makes one")
    host = request.headers.get("host", "").lower()
    name = host if host.endswith("]") else host.rpartition(":")[0] or host
    if name not in _LOCAL_NAMES:
        raise HTTPException(421, f"without tokens only {', '.join(sorted(_LOCAL_NAMES))} are answered for")
    origin = request.headers.get("origin")
    if origin is not None and request.method not in _SAFE_METHODS and origin.lower().partition("://")[2] != host:
        raise HTTPException(403, "without tokens a page from elsewhere may not change anything")


def is_loopback(host: str) -> bool:
    """Whether an address or name is this machine alone."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False
