"""The door: who may ask, how much, and which conditions an answer must meet.

Connections and requests come in; those with a valid token and of acceptable size go on to the routes, the others are
answered with problem details. It handles tokens, TLS, limits and headers, and knows nothing of the requests' content.
"""

from gateway.web.door.guard import Failures, Guard, describe_guard
from gateway.web.door.headers import AnswersHead, SecurityHeaders, content_security_policy
from gateway.web.door.problems import problem_response
from gateway.web.door.serving import Tls, refuse_open_address, renew_certificate, server_config
from gateway.web.door.tokens import Scope, Token, TokenFile
from gateway.web.door.turns import InPieces, Turns

__all__ = [
    "AnswersHead",
    "Failures",
    "Guard",
    "InPieces",
    "Scope",
    "SecurityHeaders",
    "Tls",
    "Token",
    "TokenFile",
    "Turns",
    "content_security_policy",
    "describe_guard",
    "problem_response",
    "refuse_open_address",
    "renew_certificate",
    "server_config",
]
