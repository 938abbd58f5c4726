"""Recordings of phyphox (DataExport.java of https://github.com/phyphox/phyphox-android).

One CSV per sensor with quoted headers that end in the unit, "Time (s)" from the start of the experiment, NaN where a
column is shorter, and meta/time.csv with the system time of each START and PAUSE. Column and decimal separators are the
user's choice. The platform's sign of acceleration is not recorded.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np

from gateway.errors import LogUnreadableError
from gateway.offline.phone.tables import (
    CsvTable,
    Fixes,
    PhoneRecording,
    head_of,
    not_negative,
    number_of,
    read_table,
    separator_of,
    text_rows,
)
from gateway.records import F64, I64
from gateway.units import NS_PER_S

_AXIS: Final = re.compile(r"(?:^|\s)([xyz])\s*\(", re.IGNORECASE)


def read_phyphox(path: Path, members: Mapping[str, str]) -> PhoneRecording:
    tables = [
        read_table(path, name, text, separator_of(text), "Time (s)", NS_PER_S)
        for name, text in members.items()
        if '"Time (s)"' in head_of(text)
    ]
    clock = next((text for name, text in members.items() if name.lower().endswith("meta/time.csv")), None)
    tables = [CsvTable(t.name, _since_1970(clock, t.t_ns), t.columns, t.n_unusable) for t in tables]
    accel = [(t, axes) for t in tables if "linear" not in t.name.lower() and (axes := _axes(t, "(m/s^2)", "linear"))]
    gyro = [(t, axes) for t in tables if (axes := _axes(t, "(rad/s)"))]
    place = next((t for t in tables if any(name.startswith(("Velocity (", "Speed (")) for name in t.columns)), None)
    for what, found in (("accelerometer (with g)", accel), ("gyroscope", gyro), ("location", place)):
        if not found:
            raise LogUnreadableError(
                f"{path}: has no {what}: make an experiment with accelerometer, gyroscope and location in phyphox"
            )
    assert place is not None
    device = next(
        (text_rows(text, separator_of(text)) for name, text in members.items() if name.endswith("meta/device.csv")), []
    )
    told = {row.get("property", ""): row.get("value", "") for row in device}
    return PhoneRecording(
        path,
        f"phyphox {told.get('version', '')}".strip(),
        told.get("deviceModel", "a phone"),
        accel[0][0].vectors(accel[0][1]),
        None,
        gyro[0][0].vectors(gyro[0][1]),
        Fixes(
            place.t_ns,
            not_negative(_column(place, "Velocity (", "Speed (")),
            not_negative(_column(place, "Direction (")),
            _column(place, "Latitude ("),
            _column(place, "Longitude ("),
        ),
        sum(table.n_unusable for table in tables),
    )


def _axes(table: CsvTable, unit: str, without: str = "\0") -> tuple[str, ...]:
    """Headers of the columns x, y and z with this unit; empty if one is missing."""
    named = {
        found[1].lower(): name
        for name in table.columns
        if name.endswith(unit) and without not in name.lower() and (found := _AXIS.search(name))
    }
    return tuple(named[axis] for axis in "xyz") if len(named) == 3 else ()


def _column(table: CsvTable, *starts: str) -> F64:
    found = [column for name, column in table.columns.items() if name.startswith(starts)]
    return found[0] if found else np.full(len(table.t_ns), np.nan)


def _since_1970(clock: str | None, t_ns: I64) -> I64:
    """Experiment times (n,) relative to the last START before each; unchanged if the export has no meta/time.csv."""
    if clock is None:
        return t_ns
    rows = [row for row in text_rows(clock, separator_of(clock)) if row.get("event", "").upper() == "START"]
    starts = [(number_of(row["experiment time"]), number_of(row["system time"])) for row in rows]
    if not starts:
        return t_ns
    begun_ns = np.array([round(begun_s * NS_PER_S) for begun_s, _ in starts])
    at_ns = np.array([round(at_s * 1000) * 1_000_000 for _, at_s in starts])  # it is told in milliseconds
    last = np.clip(np.searchsorted(begun_ns, t_ns, side="right") - 1, 0, len(starts) - 1)
    since: I64 = at_ns[last] + (t_ns - begun_ns[last])
    return since
