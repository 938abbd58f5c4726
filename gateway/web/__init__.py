"""The HTTP side: latest estimate, history, stream, status, health, metrics, dashboard."""

from gateway.web.app import create_app
from gateway.web.board import Board
from gateway.web.reader import Reader
from gateway.web.settings import WebSettings
from gateway.web.status import (
    BatchCounts,
    BusStatus,
    DecodeCount,
    SignalHealth,
    State,
    Status,
    StoreStatus,
)

__all__ = [
    "BatchCounts",
    "Board",
    "BusStatus",
    "DecodeCount",
    "Reader",
    "SignalHealth",
    "State",
    "Status",
    "StoreStatus",
    "WebSettings",
    "create_app",
]
