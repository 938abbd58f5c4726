"""The HTTP side: latest estimate, history, stream, status, health, metrics, dashboard."""

from gateway.web.app import create_app
from gateway.web.door.serving import Tls, refuse_open_address, renew_certificate, server_config
from gateway.web.door.tokens import Scope, Token, TokenFile
from gateway.web.live.board import Board, boot_clock_s
from gateway.web.reader import Reader
from gateway.web.routes.known_loads import KnownLoad, KnownLoads
from gateway.web.routes.weights import LatestWeights, Scales, weigh_latest
from gateway.web.settings import WebSettings

__all__ = [
    "Board",
    "KnownLoad",
    "KnownLoads",
    "LatestWeights",
    "Reader",
    "Scales",
    "Scope",
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
