"""Recordings of Sensor Logger (https://github.com/tszheichoi/awesome-sensor-logger).

UNITS.md, COORDINATES.md and CROSSPLATFORM.md there: one CSV a sensor with the columns time, seconds_elapsed, z, y, x:
nanoseconds since 1970, m/s2 and rad/s. Android has gravity in TotalAcceleration; on iOS it is Accelerometer plus
Gravity. iOS counts all three axes of acceleration the other way, unless "Standardise Units & Frames" is on, which
Metadata.csv states as ``standardisation``. Both platforms rotate the gyroscope alike. A speed, bearing or accuracy
below 0 in Location is invalid.
"""

import csv
import io
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
    read_table,
)
from gateway.units import STANDARD_GRAVITY_MPS2

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
