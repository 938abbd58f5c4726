"""Access control: tokens, TLS, limits of connections and requests, and security headers.

Requests with a valid token and of acceptable size go on to the routes; the others are answered with problem details.
Nothing here depends on the content of the requests.
"""

from gateway.web.access.concurrency import ConcurrencyLimit, InChunks
from gateway.web.access.guard import Guard, WrongTokens, describe_guard
from gateway.web.access.headers import HeadAsGet, SecurityHeaders, content_security_policy
from gateway.web.access.problems import problem_response
from gateway.web.access.serving import Tls, refuse_open_address, renew_certificate, server_config
from gateway.web.access.tokens import Scope, Token, TokenFile

__all__ = [
    "ConcurrencyLimit",
    "Guard",
    "HeadAsGet",
    "InChunks",
    "Scope",
    "SecurityHeaders",
    "Tls",
    "Token",
    "TokenFile",
    "WrongTokens",
    "content_security_policy",
    "describe_guard",
    "problem_response",
    "refuse_open_address",
    "renew_certificate",
    "server_config",
]
