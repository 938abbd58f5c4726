"""One logger, one level, one form; nothing floods, and the documents tell of every event."""

import json
import logging
from pathlib import Path

import pytest

from gateway.log import LOGGER, Event, JsonFormatter, PlainFormatter, log_event, set_up_log

DEPLOYMENT = Path(__file__).parents[2] / "docs" / "deployment.md"


def record_of(event: str, name: str = LOGGER.name, **fields: object) -> logging.LogRecord:
    return logging.makeLogRecord(
        {"name": name, "msg": event, "levelno": logging.INFO, "levelname": "INFO", "created": 0.5, "fields": fields}
    )


@pytest.mark.parametrize(
    ("level", "written"),
    [("debug", ["debug", "info", "warning"]), ("info", ["info", "warning"]), ("warning", ["warning"]), ("error", [])],
)
def test_the_level_holds_for_every_event_of_ours(
    level: str, written: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    set_up_log(level, under_journald=False)
    log_event(Event.READY, level=logging.DEBUG, url="a")
    log_event(Event.READY, url="b")
    log_event(Event.READY, level=logging.WARNING, url="c")
    lines = [json.loads(line) for line in capsys.readouterr().err.splitlines()]
    assert [line["level"] for line in lines] == written
    assert all(line["event"] == "ready" and set(line) == {"t", "level", "event", "url"} for line in lines)


def test_warnings_of_other_libraries_are_logged_at_any_level(capsys: pytest.CaptureFixture[str]) -> None:
    set_up_log("error", under_journald=False)
    logging.getLogger("some.package").info("chatter")
    logging.getLogger("some.package").warning("careful")
    assert [json.loads(line)["event"] for line in capsys.readouterr().err.splitlines()] == ["careful"]


def test_a_line_is_json_with_the_priority_journald_reads_before_it() -> None:
    line = JsonFormatter(with_priority=True).format(record_of("bus silent", reason="no frame for 2 s"))
    assert line[:3] == "<6>"
    assert json.loads(line[3:]) == {
        "t": "1970-01-01T00:00:00.500+00:00",
        "level": "info",
        "event": "bus silent",
        "reason": "no frame for 2 s",
    }


def test_a_person_at_a_terminal_reads_words() -> None:
    said = PlainFormatter().format(record_of("bus silent", channel="can0"))
    assert said == "info    bus silent channel=can0"


def test_the_journal_limits_the_lines_of_a_minute() -> None:
    unit = (Path(__file__).parents[2] / "deploy/springscale.service").read_text()
    settings = dict(line.split("=", 1) for line in unit.splitlines() if line.startswith("LogRateLimit"))
    assert settings["LogRateLimitIntervalSec"] == "60"
    assert 30 <= int(settings["LogRateLimitBurst"]) <= 300


def test_the_documents_list_exactly_the_logged_events() -> None:
    _, _, section = DEPLOYMENT.read_text().partition("## What the journal shows")
    table = section.partition("\n## ")[0]
    rows = [row for row in table.splitlines() if row.startswith("| `")]
    assert sorted(name for row in rows for name in first_cell(row)) == sorted(Event)


def first_cell(row: str) -> list[str]:
    """The events that a row of the table is about."""
    return row.split("|")[1].split("`")[1::2]
