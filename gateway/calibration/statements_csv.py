"""Statements as a table: CSV of notes, or JSON of records. The good rows are read, every bad one is named.

The first row names the columns, in any order. Cells are separated by semicolons, commas or tabs; numbers have a decimal
point or comma; times are ISO, or as people write them, in the zone that the reader is given. Rows are counted as a
spreadsheet counts them: the header is row 1.
"""

import csv
import io
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta, tzinfo
from difflib import get_close_matches
from types import MappingProxyType
from typing import Any, Final

from pydantic import ValidationError

from gateway.core.vehicle import Carries
from gateway.errors import ConfigurationError
from gateway.stated.statement import HALF_CHARACTER, StatementRecord, StatementSource, is_text
from gateway.toml_file import describe_faults

COLUMNS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "vehicle": ("vehicle",),
        "id": ("id",),
        "ref": ("ref",),
        "from": ("from",),
        "until": ("until",),
        "source": ("source",),
        "payload_kg": ("load", "payload_kg"),
        "gross_kg": ("load", "gross_kg"),
        "front_axle_kg": ("load", "front_axle_kg"),
        "rear_axle_kg": ("load", "rear_axle_kg"),
        "change_kg": ("load", "change_kg"),
        "plus_minus_kg": ("load", "plus_minus_kg"),
        "behind_front_axle_m": ("place", "behind_front_axle_m"),
        "place_plus_minus_m": ("place", "plus_minus_m"),
        "left_m": ("place", "left_m"),
        "carries": ("shape", "carries"),
        "learn": ("learn",),
        "confirmed": ("confirmed",),
        "by": ("by",),
        "note": ("note",),
    }
)
"""Columns, and the place of each in a record."""
TIMES: Final = ("from", "until")
LOADS: Final = ("payload_kg", "gross_kg", "front_axle_kg", "rear_axle_kg", "change_kg")
OF_ANSWERS: Final = ("row", "at", "state", "found", "reason", "question", "drives")
"""What a service or a command says of a statement: it is not read."""
WITHDRAWN: Final = "withdrawn"  # state of those that a service lists and that no longer hold: they are left out
MOST_BYTES: Final = 50_000_000  # chosen: half a million rows
SIMILAR: Final = 0.75  # of difflib's ratio
YES: Final = frozenset({"true", "yes", "1", "ja", "oui"})
NO: Final = frozenset({"false", "no", "0", "nein", "non"})


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
        return self.vehicle is None or _plain(self.vehicle) in map(_plain, names)


def _plain(name: str) -> str:
    return name.strip().casefold()


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
    header, rows = _table(text, where)
    return _of_table(header, rows, zone)


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


def _of_json(text: str, where: str) -> ToldRows:
    try:
        told = json.loads(text)
    except (ValueError, RecursionError) as fault:
        raise StatementsFileError(f"{where}: not valid JSON: {fault}") from None
    items = told.get("items", [told]) if isinstance(told, dict) else told
    rows: list[ToldRow] = []
    faults: dict[int, tuple[str, ...]] = {}
    for number, item in enumerate(items if isinstance(items, list) else [items], 1):
        if not is_text(item):
            faults[number] = (f"row {number}: {HALF_CHARACTER}",)
            continue
        content = dict(item) if isinstance(item, dict) else item
        if isinstance(content, dict) and content.get("state") == WITHDRAWN:
            continue
        vehicle = content.pop("vehicle", None) if isinstance(content, dict) else None
        for name in OF_ANSWERS if isinstance(content, dict) else ():
            content.pop(name, None)
        try:
            record = StatementRecord.model_validate(content).identified()
            rows.append(ToldRow(number, None if vehicle is None else str(vehicle), record))
        except ValidationError as fault:
            faults[number] = _sentences(number, fault)
    return ToldRows(tuple(rows), faults, ())


def _table(text: str, where: str) -> tuple[tuple[int, list[str]], list[tuple[int, list[str]]]]:
    """The header and the other rows that are not blank, each with its number."""
    lines = text.splitlines()
    first = next((line for line in lines if line.strip()), "")
    separator = _separator(first)
    if stated := re.fullmatch(r"\"?sep=(.)\"?\s*", first, re.IGNORECASE):
        separator = stated[1]
    every = enumerate(_cells(text, separator), 1)
    rows = [(number, [cell.strip() for cell in row]) for number, row in every if any(cell.strip() for cell in row)]
    if stated and rows:
        rows = rows[1:]
    if not rows:
        raise StatementsFileError(f"{where}: holds no row: the first one names the columns, such as {_EXAMPLE}")
    number, cells = rows[0]
    names = [re.sub(r"[\s-]+", "_", cell.strip().strip("\"'").lower()) for cell in cells]
    if not any(name in COLUMNS for name in names):
        raise StatementsFileError(
            f"{where}: row {number}: names no column of a statement: write a first row such as {_EXAMPLE}"
        )
    faults = [fault for name in dict.fromkeys(names) for fault in _header_faults(name, names)]
    if "from" not in names:
        faults.append("no column from: each statement needs the time from which it holds")
    if not {*LOADS, "source"} & {*names}:
        faults.append(f"no column with a load: add one of {', '.join(LOADS)}")
    if faults:
        raise StatementsFileError("\n".join(f"{where}: row {number}: {fault}" for fault in faults))
    return (number, names), rows[1:]


def _cells(text: str, separator: str) -> list[list[str]]:
    """Every row. If a quotation mark that nothing closes swallows rows, each line is read for itself."""
    try:
        rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=separator))
    except csv.Error:
        rows = []
    least = max(1, len(rows[0]) - 1) if rows else 1
    if rows and not any("\n" in cell and cell.count(separator) >= least for row in rows for cell in row):
        return rows
    return [_cells_of_line(line, separator) for line in re.split(r"\r\n|\r|\n", text)]


def _cells_of_line(line: str, separator: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=separator), [])
    except csv.Error:  # a cell of more than 128 kB
        return [cell[:100] for cell in line.split(separator)]


_EXAMPLE: Final = "from;until;source;payload_kg;plus_minus_kg;ref"


def _separator(header: str) -> str:
    return max(";,\t", key=lambda one: (header.count(one), one == ";"))


def _header_faults(name: str, names: Sequence[str]) -> Iterator[str]:
    if name in COLUMNS:
        if names.count(name) > 1:
            yield f"column {name} is there {names.count(name)} times"
    elif meant := get_close_matches(name, COLUMNS, 1, SIMILAR):
        yield f"unknown column {name}: did you mean {meant[0]}?"


def _of_table(header: tuple[int, list[str]], rows: Sequence[tuple[int, list[str]]], zone: tzinfo | None) -> ToldRows:
    _, names = header
    unread = [name for name in names if name and name not in COLUMNS]
    notes = [f"columns that are not read: {', '.join(unread)}"] if unread else []
    reader = _Reader(names, rows, zone)
    told: list[ToldRow] = []
    faults: dict[int, tuple[str, ...]] = {}
    for number, cells in rows:
        found = reader.row(number, cells)
        if isinstance(found, ToldRow):
            told.append(found)
        else:
            faults[number] = found
    if zone is None and reader.is_zone_needed:
        notes.append("times without a zone are read as UTC; if that is wrong, state --timezone, such as Europe/Berlin")
    return ToldRows(tuple(told), faults, tuple(notes))


class _Reader:
    """Reads cells as the whole file writes them: its decimal sign and the order of its dates."""

    def __init__(self, names: Sequence[str], rows: Sequence[tuple[int, list[str]]], zone: tzinfo | None) -> None:
        self._names, self._zone = names, zone
        self.is_zone_needed = False
        cells = [pair for _, row in rows for pair in zip(names, row, strict=False)]
        numbers = [cell for name, cell in cells if _is_number(name)]
        self._decimal = _only({sign for cell in numbers if (sign := _decimal_sign(cell))})
        times = [cell for name, cell in cells if name in TIMES]
        self._order = _only({order for cell in times if (order := _date_order(cell))})

    def row(self, number: int, cells: Sequence[str]) -> ToldRow | tuple[str, ...]:
        """The row, or a sentence for each of its faults."""
        if any(cells[len(self._names) :]):
            return (
                f"row {number}: has {len(cells)} cells, the header names {len(self._names)}: quote a cell that holds "
                "the separator, or separate cells by semicolons",
            )
        told: dict[str, Any] = {}
        vehicle: str | None = None
        faults = []
        for name, cell in zip(self._names, cells, strict=False):
            if not cell or name not in COLUMNS:
                continue
            if name == "vehicle":
                vehicle = cell
                continue
            try:
                *table, key = COLUMNS[name]
                (told.setdefault(table[0], {}) if table else told)[key] = self._cell(name, cell)
            except _CellError as fault:
                faults.append(f"row {number}: {name}: {fault}")
        if "from" not in told and not any(": from: " in fault for fault in faults):
            faults.append(f"row {number}: from: missing: write the time from which it holds")
        if faults:
            return tuple(faults)
        if "source" not in told:
            told["source"] = _usual_source(told.get("load", {}))
        if told["source"] == StatementSource.EMPTY:
            told.setdefault("load", {}).setdefault("payload_kg", 0.0)
        elif not told.get("load", {}).keys() & {*LOADS}:
            return (f"row {number}: says no load: fill one of {', '.join(LOADS)}, or write empty as its source",)
        try:
            return ToldRow(number, vehicle, StatementRecord.model_validate(told).identified())
        except ValidationError as fault:
            return _sentences(number, fault)

    def _cell(self, name: str, cell: str) -> Any:
        if name in TIMES:
            return self._time(cell, is_end=name == "until")
        if _is_number(name):
            return _number(cell, name.rpartition("_")[2], self._decimal)
        if name in ("learn", "confirmed"):
            return _truth(cell)
        if name in ("source", "carries"):
            return _word(cell, [str(one) for one in (StatementSource if name == "source" else Carries)])
        return cell

    def _time(self, cell: str, *, is_end: bool) -> datetime:
        found, has_time = _datetime(cell, self._order)
        if found.tzinfo is None:
            self.is_zone_needed = True
            found = found.replace(tzinfo=self._zone or UTC)
            if not has_time and is_end:
                found += timedelta(days=1)
            _require_one_moment(found, cell)
        if not 1970 <= found.year <= 2250:
            raise _CellError(f"{cell}: not a year of a drive")
        return found


def _is_number(name: str) -> bool:
    return name.endswith(("_kg", "_m"))


def _only(found: set[str]) -> str | None:
    """What the file shows, if it shows one thing alone."""
    return next(iter(found)) if len(found) == 1 else None


def _usual_source(load: Mapping[str, Any]) -> StatementSource:
    """The source of a row that names none."""
    if "front_axle_kg" in load:
        return StatementSource.AXLE_SCALES
    if "gross_kg" in load:
        return StatementSource.SCALE
    return StatementSource.EMPTY if load.get("payload_kg") == 0.0 else StatementSource.DELIVERY_NOTE


_SPACES: Final = re.compile("[\\s\u00a0\u2007\u2009\u202f'\u2019]+")
_PLAIN: Final = re.compile(r"[+-]?\d+(?:[.,]\d+)?")
_GROUPED: Final = re.compile(r"[+-]?\d{1,3}(?:([.,])\d{3})(?:\1\d{3})*(?:(?!\1)[.,]\d+)?")
_EITHER: Final = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")  # 1.240 is a thousand, or a little more than one


def _bare(cell: str, unit: str = "") -> str:
    """Without spaces, its unit and typographic signs."""
    cell = _SPACES.sub("", cell).replace("\u2212", "-")
    return cell.removesuffix(unit) if unit and cell.lower().endswith(unit) else cell


def _decimal_sign(cell: str) -> str | None:
    """The decimal sign that a cell shows beyond doubt."""
    cell = re.sub(r"[a-zA-Z]+$", "", _bare(cell))
    if _PLAIN.fullmatch(cell) and not _EITHER.fullmatch(cell):
        return next((sign for sign in ".," if sign in cell), None)
    if (grouped := _GROUPED.fullmatch(cell)) and (len(re.findall(r"[.,]", cell)) > 1):
        return "," if grouped[1] == "." else "."
    return None


def _number(cell: str, unit: str, decimal: str | None) -> float:
    """A number with its unit or without. Raises _CellError."""
    bare = _bare(cell, unit)
    if _EITHER.fullmatch(bare):
        sign = "." if "." in bare else ","
        if decimal is None:
            raise _CellError(
                f"{cell}: a thousand or a fraction? write {bare.replace(sign, '')} or {bare.rstrip('0').rstrip('.,')}"
            )
        bare = bare.replace(sign, "." if sign == decimal else "")
    elif _PLAIN.fullmatch(bare):
        bare = bare.replace(",", ".")
    elif grouped := _GROUPED.fullmatch(bare):
        bare = bare.replace(grouped[1], "").replace(",", ".")
    elif other := re.fullmatch(r"[+-]?[\d.,]+([a-zA-Z]{2,})", bare):
        raise _CellError(f"{cell}: is in {other[1]}: write it in {unit}")
    else:
        raise _CellError(f"{cell}: not a number: write it in {unit}, such as 310 or 12.5")
    return float(bare)


def _truth(cell: str) -> bool:
    if cell.lower() in YES | NO:
        return cell.lower() in YES
    raise _CellError(f"{cell}: write true or false")


def _word(cell: str, known: Sequence[str]) -> str:
    name = re.sub(r"[\s-]+", "_", cell.lower())
    if name in known:
        return name
    meant = get_close_matches(name, known, 1, 0.6)
    raise _CellError(f"{cell}: did you mean {meant[0]}?" if meant else f"{cell}: write one of {', '.join(known)}")


_DATE: Final = re.compile(
    r"(?P<a>\d{1,4})(?P<sep>[./-])(?P<b>\d{1,2})(?P=sep)(?P<c>\d{2,4})"
    r"(?:[ T,]+(?P<hour>\d{1,2})[:.h](?P<minute>\d{2})(?:[:.](?P<second>\d{2})(?:[.,]\d+)?)?"
    r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?(?:\s*(?:Uhr|h))?)?"
)
_ISO: Final = re.compile(r"\d{4}-\d\d-\d\d(?P<time>[ T]\d\d.*)?")


def _date_order(cell: str) -> str | None:
    """Day or month first, as a date with slashes or dashes shows beyond doubt."""
    found = _DATE.fullmatch(cell)
    if found is None or found["sep"] == "." or len(found["a"]) == 4:
        return None
    if int(found["a"]) > 12:
        return "day"
    return "month" if int(found["b"]) > 12 or found["half"] else None


def _datetime(cell: str, order: str | None) -> tuple[datetime, bool]:
    """A time, and whether it has hours. Raises _CellError."""
    if iso := _ISO.fullmatch(cell):
        try:
            return datetime.fromisoformat(cell.replace("z", "Z")), iso["time"] is not None
        except ValueError as fault:
            raise _CellError(f"{cell}: no time: {fault}") from None
    found = _DATE.fullmatch(cell)
    if found is None:
        is_serial = re.fullmatch(r"\d{4,}([.,]\d+)?", cell)
        raise _CellError(
            f"{cell}: a bare number: format the column as date and time; write it as 2026-11-26 07:40"
            if is_serial
            else f"{cell}: no time; write it as 2026-11-26 07:40"
        )
    a, b, c = (int(found[name]) for name in "abc")
    if len(found["a"]) == 4:
        year, month, day = a, b, c
    elif found["sep"] == "." or order == "day":
        day, month, year = a, b, c
    elif order == "month":
        month, day, year = a, b, c
    else:
        raise _CellError(f"{cell}: day or month first? write it as 2026-11-26 07:40")
    hour = int(found["hour"] or 0)
    if half := found["half"]:
        hour = hour % 12 + (12 if half[0] in "pP" else 0)
    try:
        minute, second = int(found["minute"] or 0), int(found["second"] or 0)
        when = datetime(year + (2000 if year < 100 else 0), month, day, hour, minute, second)
    except ValueError as fault:
        raise _CellError(f"{cell}: no time: {fault}") from None
    return when, found["hour"] is not None


def _require_one_moment(when: datetime, cell: str) -> None:
    """Raises _CellError for an hour that summer time skips or repeats."""
    if when.utcoffset() == when.replace(fold=1).utcoffset():
        return
    is_skipped = when.astimezone(UTC).astimezone(when.tzinfo).replace(tzinfo=None) != when.replace(tzinfo=None)
    raise _CellError(
        f"{cell}: does not exist when clocks change: write it with its offset, such as 2026-10-25T02:30+01:00"
        if is_skipped
        else f"{cell}: occurs twice when clocks change: write it with its offset, such as 2026-10-25T02:30+01:00"
    )


def _sentences(number: int, fault: ValidationError) -> tuple[str, ...]:
    """The faults of a record by the names of its columns."""
    names = {".".join(path): name for name, path in COLUMNS.items()}
    told = []
    for line in describe_faults(f"row {number}", fault, StatementRecord).splitlines():
        where, key, what = line.split(": ", 2)
        told.append(f"{where}: {what}" if key == "(file)" else f"{where}: {names.get(key, key)}: {what}")
    return tuple(told)
