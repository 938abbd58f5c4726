"""A phone's recording as its app exported it: a zip, or its unpacked folder."""

import csv
import io
import re
import zipfile
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Final

import numpy as np

from gateway.errors import LogUnreadableError
from gateway.offline.phone.tables import (
    CsvTable,
    Fixes,
    PhoneRecording,
    Vectors,
    head_of,
    is_named,
    not_negative,
    number_of,
    read_table,
    separator_of,
    text_rows,
)
from gateway.records import F64, I64
from gateway.units import NS_PER_S, STANDARD_GRAVITY_MPS2

LARGEST_BYTES: Final = 1 << 31  # chosen: of one unpacked CSV, a day at 200 Hz


def read_recording(path: Path) -> PhoneRecording:
    """Read an app's export. Raises LogUnreadableError naming the file, what it lacks, and how to record it."""
    members = _members(path)
    if any(is_named(name, "metadata") for name in members) or any(
        "seconds_elapsed" in head_of(t) for t in members.values()
    ):
        return read_sensor_logger(path, members)
    if any('"Time (s)"' in head_of(text) for text in members.values()):
        return read_phyphox(path, members)
    raise LogUnreadableError(
        f"{path}: is no export of Sensor Logger (CSV) or phyphox (CSV): it has {', '.join(sorted(members)) or 'no CSV'}"
    )


def _members(path: Path) -> dict[str, str]:
    """Text of every CSV by its path in the export."""
    if path.is_dir():
        found = {str(each.relative_to(path)): each.read_bytes() for each in sorted(path.rglob("*.csv"))}
    elif not path.is_file():
        raise LogUnreadableError(f"{path}: no such file")
    else:
        try:
            with zipfile.ZipFile(path) as archive:
                wanted = [each for each in archive.infolist() if each.filename.lower().endswith(".csv")]
                large = next((each for each in wanted if each.file_size > LARGEST_BYTES), None)
                if large is not None:
                    raise LogUnreadableError(
                        f"{path}: {large.filename} has {large.file_size} bytes: no drive is so long"
                    )
                found = {each.filename: archive.read(each) for each in wanted}
        except (zipfile.BadZipFile, OSError, EOFError, NotImplementedError, RuntimeError) as fault:
            raise LogUnreadableError(f"{path}: cannot be unpacked as a zip: {fault}; export it again") from None
    return {name: text.decode("utf-8-sig", errors="replace") for name, text in found.items()}


GRAVITY_WITHIN: Final = 0.1  # chosen: of gravity; a calibrated sensor on the road is this accurate


def read_sensor_logger(path: Path, members: Mapping[str, str]) -> PhoneRecording:
    tables = {
        PurePosixPath(name).stem.lower(): read_table(path, name, text, ",", "time", 1)
        for name, text in members.items()
        if "seconds_elapsed" in head_of(text)
    }
    told = next((_metadata(text) for name, text in members.items() if is_named(name, "metadata")), {})
    accel = _sensor_logger_acceleration(path, tables)
    gyro = tables.get("gyroscope") or tables.get("gyroscopeuncalibrated")
    if gyro is None:
        raise LogUnreadableError(
            f"{path}: has no Gyroscope.csv: switch the gyroscope on in Sensor Logger and drive again"
        )
    if "location" not in tables:
        raise LogUnreadableError(
            f"{path}: has no Location.csv: switch the location on in Sensor Logger and drive again"
        )
    place = tables["location"]
    nothing = np.full(len(place.t_ns), np.nan)
    return PhoneRecording(
        path,
        f"Sensor Logger {told.get('appVersion', '')}".strip(),
        f"{told.get('device name', 'a phone')} ({told.get('platform', 'platform not told')})",
        accel,
        _sensor_logger_sign(told),
        gyro.vectors("xyz"),
        Fixes(
            place.t_ns,
            not_negative(place.columns.get("speed", nothing)),
            not_negative(place.columns.get("bearing", nothing)),
            place.columns.get("latitude", nothing),
            place.columns.get("longitude", nothing),
        ),
        sum(table.n_unusable for table in tables.values()),
    )


def _metadata(text: str) -> dict[str, str]:
    """The single row by its headers. A model such as iPhone14,5 may be unquoted: surplus cells belong to it."""
    header, row = (*csv.reader(io.StringIO(text)), [], [])[:2]
    more = len(row) - len(header)
    if more > 0 and "device name" in header:
        at = header.index("device name")
        row = [*row[:at], ",".join(row[at : at + more + 1]), *row[at + more + 1 :]]
    return dict(zip(header, row, strict=False))


def _sensor_logger_acceleration(path: Path, tables: Mapping[str, CsvTable]) -> Vectors:
    """The acceleration including gravity, from the first source that has it."""
    if total := tables.get("totalacceleration"):
        return total.vectors("xyz")
    accel, gravity = tables.get("accelerometer"), tables.get("gravity")
    if accel and has_gravity(accel):
        return accel.vectors("xyz")
    if accel and gravity:
        free, down = accel.vectors("xyz"), gravity.vectors("xyz")
        along = [np.interp(free.t_ns, down.t_ns, down.xyz[:, axis]) for axis in range(3)]
        return Vectors(free.t_ns, free.xyz + np.column_stack(along))
    if raw := tables.get("accelerometeruncalibrated"):
        in_g = abs(usual_of(raw) - 1.0) < GRAVITY_WITHIN
        read = raw.vectors("xyz")
        return Vectors(read.t_ns, read.xyz * (STANDARD_GRAVITY_MPS2 if in_g else 1.0))
    raise LogUnreadableError(
        f"{path}: has no acceleration with gravity in it: switch on Total Acceleration (Android) or Accelerometer and "
        "Gravity (iOS) in Sensor Logger and drive again"
    )


def _sensor_logger_sign(told: Mapping[str, str]) -> int | None:
    """The sign by the metadata: standardised recordings follow Android, and only iOS differs."""
    platform = told.get("platform", "").lower()
    if told.get("standardisation", "").lower() == "true" or platform == "android":
        return 1
    return -1 if platform == "ios" else None


def usual_of(table: CsvTable) -> float:
    return float(np.nanmedian(np.linalg.norm(table.vectors("xyz").xyz, axis=1)))


def has_gravity(table: CsvTable) -> bool:
    return abs(usual_of(table) / STANDARD_GRAVITY_MPS2 - 1.0) < GRAVITY_WITHIN


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
