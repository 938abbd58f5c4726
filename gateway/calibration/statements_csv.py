"""Statements as a table: CSV of notes, or JSON of records. The good rows are read, every bad one is named.

The first row names the columns, in any order. Cells are separated by semicolons, commas or tabs; numbers have a decimal
point or comma; times are ISO, or as people write them, in the zone that the reader is given. Rows are counted as a
spreadsheet counts them: the header is row 1.
"""

import csv
import io
import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo
from difflib import get_close_matches
from typing import Any, Final

from pydantic import ValidationError

from gateway.core.vehicle import Carries
from gateway.errors import ConfigurationError
from gateway.files.toml_file import describe_faults
from gateway.stated.statement import HALF_CHARACTER, StatementRecord, StatementSource, is_text, of_a_drive

OF_ANSWERS: Final = ("row", "at", "state", "found", "reason", "question", "drives")
"""What a service or a command says of a statement: it is not read."""
WITHDRAWN: Final = "withdrawn"  # state of those that a service lists and that no longer hold: they are left out
MOST_BYTES: Final = 50_000_000  # chosen: half a million rows
MOST_CELL: Final = 100  # characters that are kept of a cell in a line that cannot be read
SIMILAR: Final = 0.75  # of difflib's ratio
EXAMPLE: Final = "from;until;source;payload_kg;plus_minus_kg;ref"


class StatementsFileError(ConfigurationError):
    """A file of statements cannot be read at all."""


@dataclass(frozen=True, slots=True)
class ToldRow:
    """One row that can be read. ``vehicle`` is None if the row names none."""

    number: int
    vehicle: str | None
    record: StatementRecord

    def is_of(self, *names: str) -> bool:
        """Whether it is about the vehicle of these names, or names none."""
        plain = {name.strip().casefold() for name in names}
        return self.vehicle is None or self.vehicle.strip().casefold() in plain


@dataclass(frozen=True, slots=True)
class ToldRows:
    """A file of statements: its good rows, a sentence for each fault of a bad one by row, and notes on the file."""

    rows: tuple[ToldRow, ...]
    faults: Mapping[int, tuple[str, ...]]
    notes: tuple[str, ...]

    @property
    def n_rows(self) -> int:
        """Good and bad."""
        return len(self.rows) + len(self.faults)


class _RowError(Exception):
    """A row that cannot be read: what is wrong and how to mend it, one argument for each fault."""


class _CellError(Exception):
    """A cell that cannot be read; the message says why and how to mend it."""


def read_statements(content: bytes, where: str, zone: tzinfo | None = None) -> ToldRows:
    """The statements in the content of a file. Times without a zone are in ``zone``; None: in UTC, and it is said.

    Raises StatementsFileError, naming ``where``, for what is no table of statements.
    """
    if len(content) > MOST_BYTES:
        raise StatementsFileError(
            f"{where}: {len(content)} bytes are more than a table of statements may have: split it"
        )
    text = _text(content, where)
    if text.lstrip()[:1] in ("[", "{"):
        return _of_json(text, where)
    return _of_table(text, where, zone)


def _text(content: bytes, where: str) -> str:
    """As spreadsheets save it: UTF-8, UTF-16 with a byte order mark, or Windows' code page."""
    is_wide = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    for encoding in ["utf-16"] if is_wide else ["utf-8-sig", "cp1252", "latin-1"]:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" in text:
            break
        return text
    raise StatementsFileError(f"{where}: is no text: save the table as CSV (UTF-8)")


def _read_each(rows: Iterable[tuple[int, Any]], read: Callable[[Any], tuple[str | None, Any]]) -> ToldRows:
    """Every row by ``read``, which gives the name of the vehicle and the content of a record."""
    told, faults = [], {}
    for number, row in rows:
        try:
            vehicle, content = read(row)
            told.append(ToldRow(number, vehicle, StatementRecord.model_validate(content).identified()))
        except _RowError as fault:
            faults[number] = tuple(f"row {number}: {one}" for one in fault.args)
        except ValidationError as fault:
            faults[number] = _by_columns(number, fault)
    return ToldRows(tuple(told), faults, ())


def _by_columns(number: int, fault: ValidationError) -> tuple[str, ...]:
    """The faults of a record by the names of its columns."""
    names = {path: name for name, path in COLUMNS.items()}
    told = []
    for line in describe_faults(f"row {number}", fault, StatementRecord).splitlines():
        where, key, what = line.split(": ", 2)
        told.append(f"{where}: {what}" if key == "(file)" else f"{where}: {names.get(key, key)}: {what}")
    return tuple(told)


# -- JSON --


def _of_json(text: str, where: str) -> ToldRows:
    try:
        told = json.loads(text)
    except (ValueError, RecursionError) as fault:
        raise StatementsFileError(f"{where}: not valid JSON: {fault}") from None
    items = told.get("items", [told]) if isinstance(told, dict) else told
    every = enumerate(items if isinstance(items, list) else [items], 1)
    standing = [(n, one) for n, one in every if not (isinstance(one, dict) and one.get("state") == WITHDRAWN)]
    return _read_each(standing, _of_object)


def _of_object(told: Any) -> tuple[str | None, Any]:
    if not is_text(told):
        raise _RowError(HALF_CHARACTER)
    if not isinstance(told, dict):
        return None, told
    vehicle = told.get("vehicle")
    content = {name: one for name, one in told.items() if name not in (*OF_ANSWERS, "vehicle")}
    return None if vehicle is None else str(vehicle), content


# -- tables --


@dataclass(frozen=True, slots=True)
class _Habits:
    """How a file writes its numbers and dates, as far as its cells show it: the decimal sign, and "day" or "month"
    where that comes first; and the zone of its times.
    """

    decimal: str | None
    first: str | None
    zone: tzinfo


def _of_table(text: str, where: str, zone: tzinfo | None) -> ToldRows:
    (header, names), *rows = _rows(text, where)
    if faults := list(_faults_of_header(names)):
        raise StatementsFileError("\n".join(f"{where}: row {header}: {fault}" for fault in faults))
    cells = [(name, cell) for _, row in rows for name, cell in zip(names, row, strict=False) if name in COLUMNS]
    times = [cell for name, cell in cells if name in TIMES]
    signs = {sign for name, cell in cells if name.endswith(UNITS) and (sign := _decimal_sign(_bare(cell)))}
    orders = {order for cell in times if (order := _order(cell))}
    habits = _Habits(_only(signs), _only(orders), zone or UTC)
    told = _read_each(rows, lambda row: _of_cells(names, row, habits))
    unread = [name for name in names if name and name not in COLUMNS]
    notes = [f"columns that are not read: {', '.join(unread)}"] if unread else []
    if zone is None and any(map(_is_local, times)):
        notes.append("times without a zone are read as UTC; if that is wrong, state --timezone, such as Europe/Berlin")
    return ToldRows(told.rows, told.faults, tuple(notes))


def _rows(text: str, where: str) -> list[tuple[int, list[str]]]:
    """The rows that are not blank, each with its number; the first has the names of the columns."""
    first = next((line for line in text.splitlines() if line.strip()), "")
    stated = re.fullmatch(r"\"?sep=(.)\"?\s*", first, re.IGNORECASE)
    separator = stated[1] if stated else max(";,\t", key=lambda one: (first.count(one), one == ";"))
    every = [[cell.strip() for cell in row] for row in _cells(text, separator)]
    rows = [(number, row) for number, row in enumerate(every, 1) if any(row)][1 if stated else 0 :]
    if not rows:
        raise StatementsFileError(f"{where}: holds no row: the first one names the columns, such as {EXAMPLE}")
    number, header = rows[0]
    return [(number, [re.sub(r"[\s-]+", "_", cell.strip("\"' ").lower()) for cell in header]), *rows[1:]]


def _cells(text: str, separator: str) -> list[list[str]]:
    """Every row. If a quotation mark that nothing closes swallows rows, each line is read for itself."""
    try:
        rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=separator))
    except csv.Error:  # a cell of more than 128 kB
        rows = []
    least = max(1, len(rows[0]) - 1) if rows else 1
    if rows and not any("\n" in cell and cell.count(separator) >= least for row in rows for cell in row):
        return rows
    return [_cells_of_line(line, separator) for line in re.split(r"\r\n|\r|\n", text)]


def _cells_of_line(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator), [])
    except csv.Error:  # a cell of more than 128 kB
        return [cell[:MOST_CELL] for cell in line.split(separator)]


def _faults_of_header(names: Sequence[str]) -> Iterable[str]:
    if not any(name in COLUMNS for name in names):
        yield f"names no column of a statement: write a first row such as {EXAMPLE}"
        return
    for name in dict.fromkeys(names):
        if name in COLUMNS and names.count(name) > 1:
            yield f"column {name} is there {names.count(name)} times"
        elif name not in COLUMNS and (meant := get_close_matches(name, COLUMNS, 1, SIMILAR)):
            yield f"unknown column {name}: did you mean {meant[0]}?"
    if "from" not in names:
        yield "no column from: each statement needs the time from which it holds"
    if not {*LOADS, "source"} & {*names}:
        yield f"no column with a load: add one of {', '.join(LOADS)}"


def _of_cells(names: Sequence[str], cells: Sequence[str], habits: _Habits) -> tuple[str | None, Any]:
    """The vehicle of a row, and its cells as the tables of a record."""
    if any(cells[len(names) :]):
        raise _RowError(
            f"has {len(cells)} cells, the header names {len(names)}: quote a cell that holds the separator, or "
            "separate cells by semicolons"
        )
    told: dict[str, Any] = {}
    faults = []
    for name, cell in zip(names, cells, strict=False):
        if cell and name in COLUMNS:
            *table, key = COLUMNS[name].split(".")
            try:
                (told.setdefault(table[0], {}) if table else told)[key] = _read(name, cell, habits)
            except _CellError as fault:
                faults.append(f"{name}: {fault}")
    if "from" not in told and not any(fault.startswith("from: ") for fault in faults):
        faults.append("from: missing: write the time from which it holds")
    if faults:
        raise _RowError(*faults)
    load = told.setdefault("load", {})
    told.setdefault("source", _usual_source(load))
    if told["source"] == StatementSource.EMPTY:
        load.setdefault("payload_kg", 0.0)
    elif not load.keys() & {*LOADS}:
        raise _RowError(f"says no load: fill one of {', '.join(LOADS)}, or write empty as its source")
    return told.pop("vehicle", None), told


def _usual_source(load: Mapping[str, Any]) -> StatementSource:
    """The source of a row that names none."""
    if "front_axle_kg" in load:
        return StatementSource.AXLE_SCALES
    if "gross_kg" in load:
        return StatementSource.SCALE
    return StatementSource.EMPTY if load.get("payload_kg") == 0.0 else StatementSource.DELIVERY_NOTE


def _only(found: set[str]) -> str | None:
    """What the file shows, if it shows one thing alone."""
    return next(iter(found)) if len(found) == 1 else None


# -- cells --


def _read(name: str, cell: str, habits: _Habits) -> Any:
    """What a cell of this column says."""
    if name in TIMES:
        return _time(name, cell, habits)
    if name.endswith(UNITS):
        return _number(name, cell, habits)
    return _word(name, cell) if name in WORDS else cell


_NUMBER: Final = re.compile(r"[+-]?(?:\d+|\d{1,3}(?:([.,])\d{3})(?:\1\d{3})*)(?:(?!\1)([.,])\d+)?")
_EITHER: Final = re.compile(r"[+-]?[1-9]\d{0,2}([.,])\d{3}")  # 1.240 is a thousand, or a little more than one


def _bare(cell: str, unit: str = "[a-z]*") -> str:
    """Without spaces, typographic signs and its unit."""
    cell = re.sub("[\\s\u00a0\u2007\u2009\u202f'\u2019]+", "", cell).replace("\u2212", "-")
    return re.sub(f"(?<=\\d){unit}$", "", cell, flags=re.IGNORECASE)


def _decimal_sign(bare: str) -> str | None:
    """The decimal sign that a number shows beyond doubt."""
    found = _NUMBER.fullmatch(bare)
    if found is None or _EITHER.fullmatch(bare):
        return None
    return found[2] or {".": ",", ",": ".", None: None}[found[1]]


def _number(name: str, cell: str, habits: _Habits) -> float:
    """A number with its unit or without."""
    unit = name.rpartition("_")[2]
    bare = _bare(cell, unit)
    if either := _EITHER.fullmatch(bare):
        if habits.decimal is None:
            thousand, fraction = bare.replace(either[1], ""), bare.rstrip("0").rstrip(".,")
            raise _CellError(f"{cell}: a thousand or a fraction? write {thousand} or {fraction}")
        return float(bare.replace(either[1], "." if either[1] == habits.decimal else ""))
    if found := _NUMBER.fullmatch(bare):
        return float(bare.replace(found[1] or " ", "").replace(",", "."))
    if other := re.fullmatch(r"[+-]?[\d.,]+([a-zA-Z]{2,})", bare):
        raise _CellError(f"{cell}: is in {other[1]}: write it in {unit}")
    raise _CellError(f"{cell}: not a number: write it in {unit}, such as 310 or 12.5")


def _word(name: str, cell: str) -> str | bool:
    """One of the words that a column knows."""
    known, word = WORDS[name], re.sub(r"[\s-]+", "_", cell.lower())
    if word in known:
        return known[word]
    meant = get_close_matches(word, known, 1, 0.6)
    raise _CellError(f"{cell}: did you mean {meant[0]}?" if meant else f"{cell}: write one of {', '.join(known)}")


_ISO: Final = re.compile(r"\d{4}-\d\d-\d\d([ T]\d\d.*)?")
_DATE: Final = re.compile(
    r"(?P<a>\d{1,4})(?P<sep>[./-])(?P<b>\d{1,2})(?P=sep)(?P<c>\d{2,4})"
    r"(?:[ T,]+(?P<hour>\d{1,2})[:.h](?P<minute>\d{2})(?:[:.](?P<second>\d{2})(?:[.,]\d+)?)?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?(?:\s*(?:Uhr|h))?)?"
)


def _is_local(cell: str) -> bool:
    """Whether a time lacks its zone."""
    return bool(cell) and not re.search(r"(?:[zZ]|:\d\d[+-]\d\d:?\d\d|\d[+-]\d\d:\d\d)$", cell)


def _order(cell: str) -> str | None:
    """Day or month first, as a date with slashes or dashes shows beyond doubt."""
    found = _DATE.fullmatch(cell)
    if found is None or found["sep"] == "." or len(found["a"]) == 4:
        return None
    if int(found["a"]) > 12:
        return "day"
    return "month" if int(found["b"]) > 12 or found["half"] else None


def _time(name: str, cell: str, habits: _Habits) -> datetime:
    """A time; a day as the end of a statement is the whole day."""
    try:
        iso = _ISO.fullmatch(cell)
        found, has_hour = _date(cell, habits) if iso is None else (datetime.fromisoformat(cell.upper()), iso[1])
    except ValueError as fault:
        raise _CellError(f"{cell}: no time: {fault}") from None
    try:
        of_a_drive(found)
    except ValueError as fault:
        raise _CellError(f"{cell}: {fault}") from None
    if found.tzinfo is None:
        found = found.replace(tzinfo=habits.zone)
        if name == "until" and not has_hour:
            found += timedelta(days=1)
        _require_one_moment(found, cell)
    return found


def _date(cell: str, habits: _Habits) -> tuple[datetime, str | None]:
    """A time as people write it, and its hour if it has one. Raises ValueError for a date that does not exist."""
    found = _DATE.fullmatch(cell)
    if found is None:
        is_serial = re.fullmatch(r"\d{4,}([.,]\d+)?", cell)
        raise _CellError(
            f"{cell}: a bare number: format the column as date and time; write it as 2026-11-26 07:40"
            if is_serial
            else f"{cell}: no time; write it as 2026-11-26 07:40"
        )
    a, b, c = (int(found[part]) for part in "abc")
    if len(found["a"]) == 4:
        year, month, day = a, b, c
    elif found["sep"] == "." or habits.first == "day":
        day, month, year = a, b, c
    elif habits.first == "month":
        month, day, year = a, b, c
    else:
        raise _CellError(f"{cell}: day or month first? write it as 2026-11-26 07:40")
    hour, minute, second = (int(found[part] or 0) for part in ("hour", "minute", "second"))
    if half := found["half"]:
        hour = hour % 12 + (12 if half[0] in "pP" else 0)
    return datetime(year + (2000 if year < 100 else 0), month, day, hour, minute, second), found["hour"]


def _require_one_moment(when: datetime, cell: str) -> None:
    """Refuse an hour that summer time skips or repeats."""
    if when.utcoffset() == when.replace(fold=1).utcoffset():
        return
    is_skipped = when.astimezone(UTC).astimezone(when.tzinfo).replace(tzinfo=None) != when.replace(tzinfo=None)
    raise _CellError(
        f"{cell}: does not exist when clocks change: write it with its offset, such as 2026-10-25T02:30+01:00"
        if is_skipped
        else f"{cell}: occurs twice when clocks change: write it with its offset, such as 2026-10-25T02:30+01:00"
    )


LOADS: Final = ("payload_kg", "gross_kg", "front_axle_kg", "rear_axle_kg", "change_kg")
COLUMNS: Final[Mapping[str, str]] = {
    **{name: name for name in ("vehicle", "id", "ref", "from", "until", "source", "learn", "confirmed", "by", "note")},
    **{name: f"load.{name}" for name in (*LOADS, "plus_minus_kg")},
    "behind_front_axle_m": "place.behind_front_axle_m",
    "place_plus_minus_m": "place.plus_minus_m",
    "left_m": "place.left_m",
    "carries": "shape.carries",
}
"""Columns, with the place of each in a record."""
TIMES: Final = ("from", "until")
UNITS: Final = ("_kg", "_m")  # how the names of columns of numbers end
TRUTHS: Final = {"true": True, "false": False, "yes": True, "no": False, "1": True, "0": False,
                 "ja": True, "nein": False, "oui": True, "non": False}  # fmt: skip
WORDS: Final[Mapping[str, Mapping[str, str | bool]]] = {
    "source": {str(one): str(one) for one in StatementSource},
    "carries": {str(one): str(one) for one in Carries},
    "learn": TRUTHS,
    "confirmed": TRUTHS,
}
"""Columns of words, with what each word means."""
