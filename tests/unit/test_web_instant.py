"""Points in time as clients write them."""

from datetime import UTC, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.records import iso_utc
from gateway.web.schemas import parse_instant

US_LAST = 253_402_300_799_999_999  # the end of 9999


@given(st.integers(0, US_LAST))
def test_what_we_write_we_read(t_us: int) -> None:
    assert parse_instant(iso_utc(t_us * 1000)) == t_us * 1000


@given(st.integers(-(10**9), 10**10), st.integers(-23 * 60, 23 * 60))
def test_a_zone_moves_the_clock_and_not_the_instant(t_s: int, away_min: int) -> None:
    moment = datetime.fromtimestamp(0, UTC) + timedelta(seconds=t_s)
    sign = "-" if away_min < 0 else "+"
    shown = (moment + timedelta(minutes=away_min)).strftime("%Y-%m-%dT%H:%M:%S")
    assert parse_instant(f"{shown}{sign}{abs(away_min) // 60:02d}:{abs(away_min) % 60:02d}") == t_s * 10**9


def test_nanoseconds_are_kept() -> None:
    assert parse_instant("1970-01-01T00:00:01.000000001Z") == 1_000_000_001
    assert parse_instant("1969-12-31T23:59:59.5Z") == -500_000_000


NOT_AN_INSTANT = """
5
yesterday
2026-11-21
2026-11-21T04:00:00
2026-11-21T04:00:00 01:00
2026-11-21T04:00:00+01
2026-13-01T00:00:00Z
2026-02-30T00:00:00Z
2026-11-21T24:00:01Z
2026-11-21T04:00:00+24:00
""".splitlines()


@pytest.mark.parametrize("text", [*NOT_AN_INSTANT, None, 7])
def test_anything_else_is_refused(text: object) -> None:
    with pytest.raises(ValueError):  # noqa: PT011  # half of the messages are the standard library's
        parse_instant(text)
