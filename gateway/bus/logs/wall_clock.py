"""Dates in the headers of logs, as recorders write them in many languages, and the zone in which they hold."""

import re
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from typing import Final

LONGEST_DATE: Final = 200  # chosen: characters of a line that states one

# Short names as CANoe writes them with Windows in English, German, French, Italian, Spanish, Polish, Portuguese, Dutch,
# Swedish and Czech. Longer forms (mars, marzo, marzec) begin with one of them.
_MONTHS: Final = (
    "jan gen ene sty led", "feb fév fev lut úno", "mar mär mrz maa mrt bře", "apr avr abr kwi dub",
    "may mai mag maj mei kvě", "jun juin giu cze čvn", "jul juil lug lip čvc", "aug aoû aou ago sie srp",
    "sep set wrz zář", "oct okt ott out paź paz říj", "nov lis", "dec dez déc dic gru pro",
)  # fmt: skip
_MONTH_OF: Final = {name: number for number, names in enumerate(_MONTHS, 1) for name in names.split()}
_CHINESE: Final = ["一", "二", "三", "四", "五", "六", "七", "八", "九", "十", "十一", "十二"]
_AM, _PM = ("am", "a.m.", "vorm.", "上午", "午前", "오전"), ("pm", "p.m.", "nachm.", "下午", "午後", "오후")

_TIME: Final = r"(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2})(?:[.,](?P<fraction>\d{1,9})[.\d]*)?)?"
_HALF: Final = "|".join(map(re.escape, (*_AM, *_PM)))
_BEHIND: Final = rf"(?:\s*(?P<half>{_HALF}))?(?:\s*(?P<zone>Z|UTC|GMT|[+-]\d{{2}}(?::?\d{{2}})?))?"
_FORMS: Final = tuple(
    re.compile(rf"{form}\s*$", re.IGNORECASE)
    for form in (
        rf"(?P<month>[^\W_]+)\.?\s+(?P<day>\d{{1,2}})\s+(?:(?P<before>{_HALF})\s*)?{_TIME}"
        rf"(?:\s*(?P<half>{_HALF}))?\s+(?P<year>\d{{4}})",
        rf"(?P<year>\d{{4}})-(?P<month>\d{{2}})-(?P<day>\d{{2}})[T\s]{_TIME}{_BEHIND}",
        rf"(?P<day>\d{{1,2}})\.(?P<month>\d{{1,2}})\.(?P<year>\d{{4}})\s+{_TIME}{_BEHIND}",
    )
)


def date_in(text: str) -> datetime | None:
    """The date with which a header's line ends; None if it has none that can be read to the end. Aware only if the text
    states a zone.
    """
    text = text[:LONGEST_DATE]
    told = next((found.groupdict() for form in _FORMS if (found := form.search(text))), None)
    month = None if told is None else _month(told["month"])
    if told is None or month is None:
        return None
    half = (told["half"] or told.get("before") or "").lower()
    hour = int(told["hour"])
    if half in _PM and hour < 12:
        hour += 12
    elif half in _AM and hour == 12:
        hour = 0
    second, microsecond = int(told["second"] or 0), int((told["fraction"] or "0").ljust(6, "0")[:6])
    try:
        zone = _zone(told.get("zone"))
        return datetime(
            int(told["year"]), month, int(told["day"]), hour, int(told["minute"]), second, microsecond, zone
        )
    except (ValueError, OverflowError):  # the 31st of April, 25 o'clock
        return None


def _zone(told: str | None) -> tzinfo | None:
    if told is None or told[0] not in "+-":
        return UTC if told else None
    offset = timedelta(hours=int(told[1:3]), minutes=int(told[3:].removeprefix(":") or 0))
    return timezone(offset if told[0] == "+" else -offset)


def _month(told: str) -> int | None:
    name = told.casefold().removesuffix("月")
    if name.isdecimal():
        return int(name)
    if name in _CHINESE:
        return _CHINESE.index(name) + 1
    return next((_MONTH_OF[name[:n]] for n in (4, 3) if name[:n] in _MONTH_OF), None)


def days_since_1899(days: float) -> datetime | None:
    """The wall clock's date that PEAK's ;$STARTTIME states."""
    try:
        return datetime(1899, 12, 30) + timedelta(days=days)
    except (OverflowError, ValueError):
        return None


def ns_since_1970(date: datetime, zone: tzinfo | None) -> int:
    """Nanoseconds since 1970, UTC, to the microsecond; ``zone`` (None: UTC) holds for a date that states none."""
    aware = date if date.tzinfo is not None else date.replace(tzinfo=zone or UTC)
    return (aware - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1) * 1000


def is_ambiguous(date: datetime, zone: tzinfo | None) -> bool:
    """Whether clocks of the zone showed this time twice, or not at all, because they were set that day."""
    first, second = (date.replace(tzinfo=date.tzinfo or zone or UTC, fold=fold) for fold in (0, 1))
    return first.utcoffset() != second.utcoffset()
