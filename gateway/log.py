"""The log: all events go through one logger, as JSON lines, or as plain text at a terminal.

Standard error is the service's log; systemd stores it in the journal and limits the lines of a minute.
docs/deployment.md describes every event.
"""

import json
import logging
import sys
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, Final

LOGGER: Final = logging.getLogger("gateway")

_SYSLOG_PRIORITY: Final = {
    logging.DEBUG: 7,
    logging.INFO: 6,
    logging.WARNING: 4,
    logging.ERROR: 3,
    logging.CRITICAL: 2,
}


class Event(StrEnum):
    """Every event that the service logs; the fields beside it give the details."""

    STARTED = "started"
    READY = "ready"
    STATE = "state"
    STOPPED = "stopped"
    NOT_RESTORED = "stored estimates cannot be shown yet"
    CALIBRATION_CHANGED = "calibration changed"
    SETUP_REFUSED = "signal map or calibration cannot be used"
    PART_DIED = "part died"
    PART_FAILED = "part failed"
    PART_LATE = "part did not stop in time"
    PIPELINE_LATE = "pipeline did not finish in time"
    BUS_RECEIVING = "bus receiving"
    BUS_SILENT = "bus silent"
    BUS_FAULT = "bus fault"
    BUS_REOPENED = "bus reopened"
    ADAPTER_CLOCK = "adapter clock dated"
    ESTIMATE = "estimate"
    ENTRY = "load event or trip reported"
    REJECTED = "batch rejected"
    REASONS_CHANGED = "reasons of rejection changed"
    STALE = "estimate stale"
    FRESH = "estimate fresh"
    ALARM = "alarm raised"
    ALARM_ENDED = "alarm ended"
    STORE_HOLDS = "store keeps rows in memory"
    STORE_RECOVERED = "store is on disk again"
    STORE_DAMAGED = "database set aside"
    STORE_BAD_RECORD = "bad record left out"
    STORE_REPLACED = "database removed or replaced by somebody"
    STORE_FORGETS = "old damaged database removed"
    CLOCK_DOUBTED = "clock far ahead, age removes nothing"
    CLOCK_BELIEVED = "clock believed again"
    STORE_RESERVE = "the disk is full, store gives up its reserve"
    STORE_LOST_ROWS = "store closed with rows unwritten"
    UPLINK_CONNECTED = "uplink connected"
    UPLINK_LOST = "uplink lost"
    UPLINK_NOT_REACHED = "uplink not reached"
    UPLINK_REFUSED = "uplink refused an estimate"
    STATEMENTS_REFUSED = "statements from the broker refused"
    WEBHOOK_CONNECTED = "webhook taken again"
    WEBHOOK_FAILED = "webhook not taken"
    WEBHOOK_REFUSED = "webhook gives up on a message"
    RECORD_REFUSED = "frames not recorded"
    RECORD_RECOVERED = "frames recorded again"
    STATED = "stated"
    STATEMENT_WITHDRAWN = "statement withdrawn"
    STATEMENT_CONFIRMED = "statement confirmed"
    VEHICLE_STATED = "vehicle stated"
    SISTER_STATED = "vehicle of the same model stated"
    LEARNT = "learnt"
    NOT_LEARNT = "not learnt"
    VERSION_CHOSEN = "version chosen"
    NOT_EMPTY = "drives were not empty"
    DRIVE_NOT_KEPT = "drive not kept"
    LEARNING_SET_ASIDE = "broken learning set aside"
    TOKENS_UNREADABLE = "no token is accepted"


def log_event(event: Event, *, level: int = logging.INFO, **fields: object) -> None:
    """Write one event with its fields, which programs can query by name."""
    LOGGER.log(level, event.value, extra={"fields": fields})


OnEvent = Callable[[str, Mapping[str, Any]], object]  # a listener that stores events: name and fields


def tell_event(event: Event, fields: Mapping[str, Any], keep: OnEvent, level: int = logging.INFO) -> None:
    """Write an event to the log, and hand it to ``keep``, which stores it."""
    log_event(event, level=level, **fields)
    keep(event.value.replace(" ", "_"), fields)


class JsonFormatter(logging.Formatter):
    """{"t": ..., "level": ..., "event": ..., further keys}; journald reads the priority before it (sd-daemon(3))."""

    def __init__(self, *, with_priority: bool) -> None:
        super().__init__()
        self._with_priority = with_priority

    def format(self, record: logging.LogRecord) -> str:
        """One line."""
        entry: dict[str, Any] = {
            "t": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "event": record.getMessage(),
            **_fields(record),
        }
        if record.exc_info:
            entry["exception"] = self.formatException(record.exc_info)
        prefix = f"<{_SYSLOG_PRIORITY.get(record.levelno, 6)}>" if self._with_priority else ""
        return prefix + json.dumps(entry, default=str)


class PlainFormatter(logging.Formatter):
    """level event key=value ..., for people at a terminal."""

    def format(self, record: logging.LogRecord) -> str:
        """One line."""
        fields = " ".join(f"{key}={said}" for key, said in _fields(record).items())
        line = f"{record.levelname.lower():7} {record.getMessage()} {fields}".rstrip()
        return f"{line}\n{self.formatException(record.exc_info)}" if record.exc_info else line


def set_up_log(level: str, *, under_journald: bool) -> None:
    """Sends all log lines to standard error: our own events from ``level`` on (debug, info, warning or error).

    Other libraries' lines are sent from warnings on.
    """
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(PlainFormatter() if sys.stderr.isatty() else JsonFormatter(with_priority=under_journald))
    logging.basicConfig(level=logging.WARNING, handlers=[handler], force=True)
    LOGGER.setLevel(level.upper())


def _fields(record: logging.LogRecord) -> dict[str, object]:
    return getattr(record, "fields", {})
