"""A log for Springscale from a phone: python examples/phone.py RECORDING.zip DRIVE.log [AHEAD]

RECORDING.zip is an export of the app Sensor Logger on Android with Total Acceleration, Gyroscope (both as fast as they
go) and Location. The phone lies fixed to the floor of the load room from before the first metre to the end; cut the
recording in the app if it was carried. DRIVE.log is candump text in the frames of the map springscale:reference:

    springscale calibrate campaign.toml --output vehicle.json      # signals = "springscale:reference"
    springscale estimate drive.log --signals springscale:reference --calibration vehicle.json

Up is the direction of gravity in the phone. Forward is the horizontal direction in which braking and bends are felt:
with the horizontal specific force h as a complex number, h = exp(j angle) (dv/dt + j v w_up), because a vehicle
accelerates along its forward axis and towards the inside of a bend. One least-squares angle follows from both
(orthogonal Procrustes in the plane; P. H. Schoenemann, Psychometrika 31, 1966), and the delay of the satellite speed is
the one that fits best. AHEAD, one of x -x y -y (y is the phone's top edge), names the axis that points ahead where the
drive is too even to tell.
"""

import csv
import io
import struct
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

LEAST_FIT = 0.4  # of the horizontal force, explained by braking and bends
MOVING_MPS = 3.0  # above a receiver's noise
DELAYS_S = np.arange(0.0, 3.0, 0.1)  # of a phone's satellite speed
MAP_LATENCY_S = 0.2  # which springscale:reference takes off the speed again
DEG = np.pi / 180.0
AHEAD = {"x": (1.0, 0.0, 0.0), "-x": (-1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "-y": (0.0, -1.0, 0.0)}


def table(archive: zipfile.ZipFile, name: str, *columns: str) -> np.ndarray:
    """The named columns (n, k) of a CSV in the export, in order of time; the first is the time in s."""
    if f"{name}.csv" not in archive.namelist():
        sys.exit(f"{archive.filename}: has no {name}.csv: switch it on in Sensor Logger and drive again")
    rows = csv.DictReader(io.StringIO(archive.read(f"{name}.csv").decode("utf-8-sig")))
    numbers = np.array([[float(row[column] or "nan") for column in columns] for row in rows])
    numbers[:, 0] *= 1e-9  # it is told in ns since 1970
    numbers = numbers[np.isfinite(numbers).all(axis=1)]
    return numbers[np.unique(numbers[:, 0], return_index=True)[1]]


def at(t_s: np.ndarray, times_s: np.ndarray, x: np.ndarray) -> np.ndarray:
    """``x`` (n,) at other times."""
    return np.interp(t_s, times_s, x)


def forward_of(accel: np.ndarray, gyro: np.ndarray, fixes: np.ndarray, up: np.ndarray) -> tuple[np.ndarray, float]:
    """The unit vector (3,) forward in the phone's axes, and the delay of the speed in s."""
    first = np.cross(np.eye(3)[np.argmin(np.abs(up))], up)
    first /= np.linalg.norm(first)
    second = np.cross(up, first)
    # running integrals, so that a difference over the time between two fixes is the mean of what is between
    felt = np.cumsum((accel[:, 1:] @ (first + 1j * second)) * np.gradient(accel[:, 0]))
    turn_radps = gyro[:, 1:] @ up
    turned = np.cumsum((turn_radps - np.median(turn_radps)) * np.gradient(gyro[:, 0]))
    best, angle, delay_s = 0.0, 0.0, 0.0
    for delay in DELAYS_S:
        begin_s, end_s = fixes[:-2, 0] - delay, fixes[2:, 0] - delay
        span_s, speed_mps = end_s - begin_s, fixes[1:-1, 1]
        horizontal = (at(end_s, accel[:, 0], felt) - at(begin_s, accel[:, 0], felt)) / span_s
        turning = (at(end_s, gyro[:, 0], turned) - at(begin_s, gyro[:, 0], turned)) / span_s
        asked = (fixes[2:, 1] - fixes[:-2, 1]) / span_s + 1j * speed_mps * turning
        is_moving = (speed_mps > MOVING_MPS) & (span_s < 5.0)
        if np.count_nonzero(is_moving) < 40:
            continue
        h, b = (x[is_moving] - x[is_moving].mean() for x in (horizontal, asked))
        correlation = np.sum(h * np.conj(b)) / np.sqrt(np.sum(np.abs(h) ** 2) * np.sum(np.abs(b) ** 2))
        if abs(correlation) > best:
            best, angle, delay_s = abs(correlation), float(np.angle(correlation)), float(delay)
    if best < LEAST_FIT:
        sys.exit("forward cannot be told: drive with some braking and bends, or name the axis ahead (y: the top edge)")
    return np.cos(angle) * first + np.sin(angle) * second, delay_s


def counts(x: np.ndarray, step: float) -> np.ndarray:
    """Raw 16-bit numbers (n, k) for a signal's step."""
    return np.clip(np.round(x / step), -32768, 32767).astype(int)


def frames(accel: np.ndarray, gyro: np.ndarray, fixes: np.ndarray) -> Iterator[tuple[float, str]]:
    """Every frame of the reference sensors: its time in s and its text."""
    for i, (t_s, row) in enumerate(zip(accel[:, 0], counts(accel[:, 1:], 0.001), strict=True)):
        yield t_s, "120#" + struct.pack("<hhhBB", *row, i % 256, 1).hex().upper()
    for i, (t_s, row) in enumerate(zip(gyro[:, 0], counts(gyro[:, 1:] / DEG, 0.005), strict=True)):
        yield t_s, "121#" + struct.pack("<hhhBB", *row, i % 256, 1).hex().upper()
    for t_s, speed_mps in fixes:
        yield t_s, "130#" + struct.pack("<HBB", round(speed_mps / 0.002), 10, 3).hex().upper()


def convert(recording: Path, log: Path, ahead: str | None = None) -> None:
    """Write the log of a recording."""
    with zipfile.ZipFile(recording) as archive:
        accel = table(archive, "TotalAcceleration", "time", "x", "y", "z")
        gyro = table(archive, "Gyroscope", "time", "x", "y", "z")
        fixes = table(archive, "Location", "time", "speed")
    fixes = fixes[fixes[:, 1] >= 0.0]
    gravity = accel[:, 1:].mean(axis=0)
    up = gravity / np.linalg.norm(gravity)
    if ahead is None:
        forward, delay_s = forward_of(accel, gyro, fixes, up)
    else:
        forward, delay_s = np.array(AHEAD[ahead]), 0.0
        forward = forward - up * (forward @ up)
        forward /= np.linalg.norm(forward)
    to_vehicle = np.column_stack([forward, np.cross(up, forward), up])  # x forward, y left, z up
    accel[:, 1:], gyro[:, 1:] = accel[:, 1:] @ to_vehicle, gyro[:, 1:] @ to_vehicle
    fixes[:, 0] += MAP_LATENCY_S - delay_s
    with log.open("x", encoding="ascii") as file:
        file.writelines(f"({t_s:.6f}) phone0 {text}\n" for t_s, text in sorted(frames(accel, gyro, fixes)))


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    convert(Path(sys.argv[1]), Path(sys.argv[2]), *sys.argv[3:4])
