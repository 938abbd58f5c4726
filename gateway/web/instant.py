"""Points in time as clients write them: RFC 3339, with a zone, to the nanosecond."""

import re
from datetime import UTC, datetime, timedelta, timezone
from typing import Annotated, Final

from pydantic import BeforeValidator, WithJsonSchema

from gateway.units import NS_PER_S

_RFC_3339: Final = re.compile(
    r"(\d{4}-\d\d-\d\d)[Tt ](\d\d:\d\d:\d\d)(?:\.(\d{1,9})\d*)?(?:([Zz])|([+-])(\d\d):([0-5]\d))", re.ASCII
)
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


def parse_instant(text: object) -> int:
    """2026-11-21T04:00:00.5+01:00 -> ns since 1970 UTC. Raises ValueError that says what is expected."""
    match = _RFC_3339.fullmatch(text) if isinstance(text, str) else None
    if match is None:
        raise ValueError(
            "write a date and time with its zone, such as 2026-11-21T04:00:00Z (in a URL, the + of a zone is %2B)"
        )
    date, clock, fraction, utc, sign, hours, minutes = match.groups()
    away = timedelta() if utc else timedelta(hours=int(hours), minutes=int(minutes)) * (-1 if sign == "-" else 1)
    moment = datetime.fromisoformat(f"{date}T{clock}").replace(tzinfo=timezone(away))
    return int((moment - _EPOCH) // timedelta(seconds=1)) * NS_PER_S + int((fraction or "0").ljust(9, "0"))


Instant = Annotated[
    int,
    BeforeValidator(parse_instant),
    WithJsonSchema({"type": "string", "format": "date-time", "examples": ["2026-11-21T04:00:00Z"]}),
]
