"""A phone's recording, and the CSV tables of an app's export."""

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path, PurePosixPath
from typing import TypeVar

import numpy as np

from gateway.errors import LogUnreadableError
from gateway.records import F64, I64


@dataclass(frozen=True, slots=True)
class Vectors:
    """Samples of three axes: t_ns (n,) rising, xyz (n, 3) in SI and in the phone's axes."""

    t_ns: I64
    xyz: F64


@dataclass(frozen=True, slots=True)
class Fixes:
    """Satellite fixes: t_ns (n,) rising; speed_mps, bearing_deg, latitude_deg, longitude_deg (n,), NaN: invalid."""

    t_ns: I64
    speed_mps: F64
    bearing_deg: F64
    latitude_deg: F64
    longitude_deg: F64


Samples = TypeVar("Samples", Vectors, Fixes)


def _cut(samples: Samples, begin_ns: int, end_ns: int) -> Samples:
    inside = (samples.t_ns >= begin_ns) & (samples.t_ns < end_ns)
    return type(samples)(*(getattr(samples, each.name)[inside] for each in fields(samples)))


@dataclass(frozen=True, slots=True)
class PhoneRecording:
    """A phone's recording. ``accel`` includes gravity.

    ``accel_sign`` is 1 if accel is the specific force (+9.81 m/s2 upwards at rest), -1 if it is its opposite, and None
    if the export does not say. ``n_unusable`` counts rows that are not numbers or came twice.
    """

    path: Path
    app: str
    device: str
    accel: Vectors
    accel_sign: int | None
    gyro: Vectors
    fixes: Fixes
    n_unusable: int

    def within(self, begin_ns: int, end_ns: int) -> "PhoneRecording":
        """The samples and fixes in [begin, end)."""
        accel, gyro = (_cut(vectors, begin_ns, end_ns) for vectors in (self.accel, self.gyro))
        return replace(self, accel=accel, gyro=gyro, fixes=_cut(self.fixes, begin_ns, end_ns))


@dataclass(frozen=True, slots=True)
class CsvTable:
    """One CSV: its name, and columns (n,) by their headers; times separately, in ns."""

    name: str
    t_ns: I64
    columns: Mapping[str, F64]
    n_unusable: int

    def vectors(self, names: Sequence[str]) -> Vectors:
        """These three columns where all are numbers. Raises KeyError for a missing one."""
        xyz = np.column_stack([self.columns[name] for name in names])
        known = np.isfinite(xyz).all(axis=1)
        return Vectors(self.t_ns[known], xyz[known])


def head_of(text: str) -> str:
    return text[: text.find("\n")] if "\n" in text else text


def is_named(member: str, name: str) -> bool:
    """Whether a member is the sensor of this name, ignoring folders, case and spaces."""
    return PurePosixPath(member).stem.lower().replace(" ", "") == name


def read_table(path: Path, name: str, text: str, separator: str, time: str, unit_ns: int) -> CsvTable:
    """Every column as numbers, in order of time, each time once; rows without a time or of another length are
    left out.
    """
    lines = csv.reader(io.StringIO(text), delimiter=separator)
    header = next(lines, [])
    if time not in header:
        raise LogUnreadableError(f"{path}: {name}: has no column {time!r}, only {', '.join(header)}")
    at, n_rows = header.index(time), 0
    stamps: list[int] = []
    values: list[list[float]] = []
    for row in lines:
        n_rows += bool(row)
        stamp = _stamp(row[at], unit_ns) if len(row) == len(header) else None
        if stamp is not None:
            stamps.append(stamp)
            values.append([number_of(cell) for cell in row])
    if not stamps:
        raise LogUnreadableError(f"{path}: {name}: has no row of numbers")
    t_ns, first = np.unique(np.array(stamps, np.int64), return_index=True)
    columns = np.array(values)[first]
    return CsvTable(name, t_ns, {each: columns[:, i] for i, each in enumerate(header) if i != at}, n_rows - len(t_ns))


def _stamp(cell: str, unit_ns: int) -> int | None:
    """A time in ns; whole nanoseconds since 1970 have more digits than a double, so they are read as integers."""
    if unit_ns == 1 and cell.isdigit() and len(cell) < 20:
        return int(cell)
    number = number_of(cell) * unit_ns
    return round(number) if abs(number) < float(1 << 63) else None


def number_of(cell: str) -> float:
    """The number, NaN if it is none; a decimal comma is accepted."""
    try:
        return float(cell)
    except ValueError:
        try:
            return float(cell.replace(",", "."))
        except ValueError:
            return math.nan


def separator_of(text: str) -> str:
    """The character after the first quoted header."""
    found = re.match(r'"[^"]*"([,;\t])', text)
    return found[1] if found else ","


def text_rows(text: str, separator: str) -> list[dict[str, str]]:
    """A small table of text by its headers."""
    return [{k: v or "" for k, v in row.items() if k} for row in csv.DictReader(io.StringIO(text), delimiter=separator)]


def not_negative(column: F64) -> F64:
    return np.where(column >= 0.0, column, np.nan)
