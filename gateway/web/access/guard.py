"""Authorization: with tokens, clients that send a valid one; without tokens, only this machine."""

import ipaddress
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from typing import Any, Final

from starlette.datastructures import Headers
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Send
from starlette.types import Scope as AsgiScope

from gateway.web.access.problems import problem_response
from gateway.web.access.tokens import Scope, TokenFile

# These contain nothing about the vehicle: the pages' own files, the API's description, and whether the process lives.
PUBLIC: Final = ("/assets/", "/swagger/")
PUBLIC_PATHS: Final = frozenset({"/", "/cab", "/docs", "/openapi.json", "/health/live"})
_SAFE_METHODS: Final = frozenset({"GET", "HEAD", "OPTIONS"})
_FORWARDED: Final = ("forwarded", "via", "x-forwarded-for", "x-forwarded-host", "x-forwarded-proto", "x-real-ip")
_LOCAL_NAMES: Final = frozenset({"localhost", "127.0.0.1", "[::1]"})

HOW_TO_MAKE_ONE: Final = "`springscale token create NAME --config springscale.toml` on the gateway"
WITHIN_S: Final = 60.0  # chosen: the minute of ``n_wrong_tokens_per_min``
_ADDRESSES: Final = 1024  # chosen: remembered; the longest quiet is forgotten first


class WrongTokens:
    """Wrong tokens by address: after ``n_per_min`` failures further ones have to wait. Bounded."""

    def __init__(self, n_per_min: int, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._n_per_min = n_per_min
        self._clock_s = clock_s
        self._by_address: OrderedDict[str, deque[float]] = OrderedDict()

    def note(self, address: str) -> int | None:
        """Count one failure -> seconds to wait, None while there were few."""
        now_s = self._clock_s()
        times = self._by_address.setdefault(address, deque(maxlen=self._n_per_min))
        self._by_address.move_to_end(address)
        if len(self._by_address) > _ADDRESSES:
            self._by_address.popitem(last=False)
        if len(times) == self._n_per_min and now_s - times[0] < WITHIN_S:
            return max(1, round(WITHIN_S - (now_s - times[0])))
        times.append(now_s)
        return None


class Guard:
    """ASGI middleware that checks tokens. A valid token always passes, whatever failed from the same address."""

    def __init__(self, app: ASGIApp, tokens: TokenFile | None, failures: WrongTokens) -> None:
        self._app = app
        self._tokens = tokens
        self._failures = failures

    async def __call__(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        refusal = self._refusal(scope) if scope["type"] == "http" else None
        await (self._app if refusal is None else refusal)(scope, receive, send)

    def _refusal(self, scope: AsgiScope) -> Response | None:
        if self._tokens is None or not self._tokens.are_required():  # the first token counts from its first moment
            return _refuse_strangers(scope)
        path: str = scope["path"]
        if path in PUBLIC_PATHS or path.startswith(PUBLIC):
            return None
        return self._refuse_without_token(scope, self._tokens)

    def _refuse_without_token(self, scope: AsgiScope, tokens: TokenFile) -> Response | None:
        shown = Headers(scope=scope).get("authorization")
        kind, _, text = (shown or "").partition(" ")
        token = tokens.verify(text.strip()) if kind.lower() == "bearer" else None
        wanted = Scope.READ if scope["method"] in _SAFE_METHODS else Scope.OPERATE
        if token is not None:
            scope.setdefault("state", {})["token_name"] = token.name
            return None if token.scope.allows(wanted) else _forbidden(scope, wanted)
        if shown is None:
            return _unauthorised(scope, f"a bearer token is needed: {HOW_TO_MAKE_ONE} makes one", "")
        wait_s = self._failures.note(scope["client"][0] if scope.get("client") else "")
        if wait_s is not None:
            return _problem(scope, 429, "too many wrong tokens from this address", {"retry-after": str(wait_s)})
        return _unauthorised(scope, "this token is not known, revoked or expired", ', error="invalid_token"')


def _refuse_strangers(scope: AsgiScope) -> Response | None:
    """Without tokens: only from this machine, and only under a local name (else a web page could ask by DNS tricks)."""
    client = scope.get("client")
    if client is not None and not is_loopback(client[0]):
        return _problem(scope, 403, f"without tokens only this machine is answered: {HOW_TO_MAKE_ONE} makes one")
    headers = Headers(scope=scope)
    if any(name in headers for name in _FORWARDED):  # the proxy is local, its clients are not
        return _problem(scope, 403, f"without tokens nobody is answered through a proxy: {HOW_TO_MAKE_ONE} makes one")
    host = headers.get("host", "").lower()
    name = host if host.endswith("]") else host.rpartition(":")[0] or host
    if name not in _LOCAL_NAMES:
        return _problem(scope, 421, f"without tokens only {', '.join(sorted(_LOCAL_NAMES))} are answered for")
    origin = headers.get("origin")
    if origin is not None and scope["method"] not in _SAFE_METHODS and origin.lower().partition("://")[2] != host:
        return _problem(scope, 403, "without tokens a page from elsewhere may not change anything")
    return None


def is_loopback(host: str) -> bool:
    """Whether an address or name is this machine alone."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def describe_guard(schema: dict[str, Any]) -> None:
    """Declare in the API's description that a bearer token is needed, and where not."""
    problem = {"application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}}
    schema["components"]["securitySchemes"] = {"bearer": {"type": "http", "scheme": "bearer"}}
    schema["security"] = [{"bearer": []}]
    for path, operations in schema["paths"].items():
        for operation in operations.values():
            if path in PUBLIC_PATHS:
                operation["security"] = []
                continue
            for code, text in (("401", "No valid token"), ("403", "Not for this token"), ("429", "Too many failures")):
                operation["responses"][code] = {"description": text, "content": problem}


def _unauthorised(scope: AsgiScope, detail: str, why: str) -> Response:
    return _problem(scope, 401, detail, {"www-authenticate": f'Bearer realm="springscale"{why}'})


def _forbidden(scope: AsgiScope, wanted: Scope) -> Response:
    why = f'Bearer realm="springscale", error="insufficient_scope", scope="{wanted}"'
    return _problem(scope, 403, f"this needs a token with scope {wanted}", {"www-authenticate": why})


def _problem(scope: AsgiScope, status: int, detail: str, headers: dict[str, str] | None = None) -> Response:
    return problem_response(status, detail, scope["path"], headers=headers)
