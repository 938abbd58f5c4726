"""The service's log: one JSON line an event with stable keys, or plain lines on a terminal."""

import json
import logging
import sys
from datetime import UTC, datetime
from typing import Any

LOGGER = logging.getLogger("springscale")

_SYSLOG_PRIORITY = {logging.DEBUG: 7, logging.INFO: 6, logging.WARNING: 4, logging.ERROR: 3, logging.CRITICAL: 2}


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
            **getattr(record, "fields", {}),
        }
        if record.exc_info:
            entry["exception"] = self.formatException(record.exc_info)
        prefix = f"<{_SYSLOG_PRIORITY.get(record.levelno, 6)}>" if self._with_priority else ""
        return prefix + json.dumps(entry, default=str)


class PlainFormatter(logging.Formatter):
    """level event key=value ..., for people at a terminal."""

    def format(self, record: logging.LogRecord) -> str:
        """One line."""
        fields = " ".join(f"{key}={said}" for key, said in getattr(record, "fields", {}).items())
        line = f"{record.levelname.lower():7} {record.getMessage()} {fields}".rstrip()
        return f"{line}\n{self.formatException(record.exc_info)}" if record.exc_info else line


def set_up_log(level: str, *, under_journald: bool) -> None:
    """Everything goes to standard error; other libraries' warnings and worse come through as well."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(PlainFormatter() if sys.stderr.isatty() else JsonFormatter(with_priority=under_journald))
    logging.basicConfig(level=logging.WARNING, handlers=[handler], force=True)
    set_log_level(level)


def set_log_level(level: str) -> None:
    """The least level of our own events that is written: debug, info, warning or error."""
    LOGGER.setLevel(level.upper())


def log_event(event: str, *, level: int = logging.INFO, **fields: Any) -> None:
    """One event with its fields."""
    LOGGER.log(level, event, extra={"fields": fields})
