"""The HTTP side: latest estimate, history, stream, status, health, metrics, dashboard."""

from gateway.web.app import create_app
from gateway.web.board import Board, boot_clock_s
from gateway.web.known_loads import KnownLoad, KnownLoads
from gateway.web.reader import Reader
from gateway.web.serving import Tls, refuse_open_address, renew_certificate, server_config
from gateway.web.settings import WebSettings
from gateway.web.status import (
    BatchCounts,
    BusStatus,
    DecodeCount,
    SignalHealth,
    State,
    Status,
    StoreStatus,
    UplinkStatus,
)
from gateway.web.tokens import Scope, Token, TokenFile

__all__ = [
    "BatchCounts",
    "Board",
    "BusStatus",
    "DecodeCount",
    "KnownLoad",
    "KnownLoads",
    "Reader",
    "Scope",
    "SignalHealth",
    "State",
    "Status",
    "StoreStatus",
    "Tls",
    "Token",
    "TokenFile",
    "UplinkStatus",
    "WebSettings",
    "boot_clock_s",
    "create_app",
    "refuse_open_address",
    "renew_certificate",
    "server_config",
]
