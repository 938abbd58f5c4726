"""The HTTP side: latest estimate, history, stream, status, health, metrics, dashboard.

The board supplies estimates, a reader the history, and a call the service's status; the web answers every client with a
token. ``create_app`` builds the application from access control, the live board and the routes.
"""

from gateway.store import StoreReader
from gateway.web.access import (
    Scope,
    Tls,
    Token,
    TokenFile,
    refuse_open_address,
    renew_certificate,
    server_config,
)
from gateway.web.app import WebSettings, create_app
from gateway.web.live import Board, boot_clock_s
from gateway.web.routes.known_loads import KnownLoad, KnownLoads
from gateway.web.routes.weights import LatestWeights, Scales, weigh_latest

__all__ = [
    "Board",
    "KnownLoad",
    "KnownLoads",
    "LatestWeights",
    "Scales",
    "Scope",
    "StoreReader",
    "Tls",
    "Token",
    "TokenFile",
    "WebSettings",
    "boot_clock_s",
    "create_app",
    "refuse_open_address",
    "renew_certificate",
    "server_config",
    "weigh_latest",
]
