"""The gyro's gain, measured in bends: what turns a vehicle also accelerates it sideways.

    gyro_gain_of(Bends(lateral_acceleration_mps2, yaw_rate_radps, ...), usable, rate_hz) -> (gain, std) | None

In a bend the accelerometer reads speed times yaw rate, and beside it g times the roll angle, which is the integral of
the roll rate. So bends compare the gyro with the accelerometer, as gravity checks the accelerometer itself.
All three rates come from one device: if its gain changes, that of the pitch rate changes too.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Final

import numpy as np

from gateway.core.spectrum import runs_of
from gateway.records import F64, Bool
from gateway.units import STANDARD_GRAVITY_MPS2

BLOCK_S: Final = 1.0  # means over so long leave out what suspension and engine add
LEAST_PIECE_S: Final = 20.0
MOST_PIECE_S: Final = 60.0  # by then a gyro's bias has drifted as a parabola can follow
LEAST_S: Final = 60.0
PER_STATED_STD: Final = 1.5  # residuals of neighbouring blocks are alike
GAIN_STD: Final = 0.004
"""Of one batch, beside what its residuals say: recorded drives of one sensor scatter so (docs/method.md)."""
MOST_STD: Final = 0.015  # a batch that tells less has no bends; chosen

_PRIOR: Final = np.array(
    [
        [1.0, 1e3],  # speed times yaw rate: what is sought
        [1.0, 0.03],  # g times the integral of the roll rate: the gain of another axis
        [0.0, 0.05],  # g times that of the yaw rate: the gyro's z axis is tilted, 3 degrees
        [0.0, 0.06],  # change of speed: the accelerometer is turned, 3.4 degrees
        [0.0, 3.0],  # yaw acceleration: the sensor sits so far (m) off the point that does not drift sideways
    ]
)
"""Mean and standard deviation of each coefficient; chosen, wider than any mount is."""
_ROUNDS: Final = 4  # of noise and coefficients in turn; the third changes nothing that is written


@dataclass(frozen=True, slots=True)
class Bends:
    """Arrays (n,) in vehicle axes (ISO 8855): y left, roll positive left side up, yaw positive nose left; NaN where
    unknown.
    """

    lateral_acceleration_mps2: F64
    yaw_rate_radps: F64
    roll_rate_radps: F64
    speed_mps: F64


@dataclass(frozen=True, slots=True)
class _Sums:
    """A'A (k, k), A'y (k,), y'y and the degrees of freedom of a least-squares problem."""

    information: F64
    pulled: F64
    square: float
    dof: int


def gyro_gain_of(bends: Bends, usable: Bool, rate_hz: float) -> tuple[float, float] | None:
    """The gyro's gain over the accelerometer's and its standard deviation; None where too little was driven in bends.

    Least squares over means of BLOCK_S. Each piece without gaps has a parabola and a multiple of the speed of its own:
    biases of the sensors, and how the road banks.
    """
    sensed = np.array([bends.lateral_acceleration_mps2, bends.yaw_rate_radps, bends.roll_rate_radps, bends.speed_mps])
    known = usable & np.isfinite(sensed).all(axis=0)
    pieces = list(_pieces(known, rate_hz))
    if sum(len(range(*one.indices(len(known)))) for one in pieces) < LEAST_S * rate_hz:
        return None
    sums = [_normal_equations(sensed[:, one], rate_hz) for one in pieces]
    return _solved(sums)


def joined_gains(gains: Sequence[tuple[float, float] | None]) -> tuple[float, float] | None:
    """The mean of several, by their precision; None where none is known."""
    known = np.array([one for one in gains if one is not None])
    if not len(known):
        return None
    precision = known[:, 1] ** -2.0
    return float(precision @ known[:, 0] / precision.sum()), float(precision.sum() ** -0.5)


def _pieces(known: Bool, rate_hz: float) -> Iterator[slice]:
    """Stretches without gaps, the long ones cut into equal pieces."""
    for begin, end in runs_of(known).tolist():
        if end - begin >= LEAST_PIECE_S * rate_hz:
            cuts = np.linspace(begin, end, int(np.ceil((end - begin) / (MOST_PIECE_S * rate_hz))) + 1).astype(int)
            yield from (slice(a, b) for a, b in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True))


def _normal_equations(sensed: F64, rate_hz: float) -> _Sums:
    """Of one piece: lateral acceleration, rates of yaw and roll, and speed (4, n)."""
    lateral, yaw, roll, speed = sensed
    n = round(BLOCK_S * rate_hz)
    m = len(speed) // n

    def blocks(x: F64) -> F64:
        means: F64 = x[: m * n].reshape(m, n).mean(axis=1)
        return means

    def angle(rate: F64) -> F64:
        return blocks(np.cumsum(rate - rate.mean()) / rate_hz)

    g, slow = STANDARD_GRAVITY_MPS2, blocks(speed)
    told = np.column_stack(
        [
            blocks(speed * yaw),
            g * angle(roll),
            g * angle(yaw),
            np.gradient(slow, BLOCK_S),
            np.gradient(blocks(yaw), BLOCK_S),
        ]
    )
    free, _ = np.linalg.qr(np.column_stack([np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, m), 2), slow]))
    pushed = blocks(lateral)
    told, pushed = told - free @ (free.T @ told), pushed - free @ (free.T @ pushed)
    return _Sums(told.T @ told, told.T @ pushed, float(pushed @ pushed), m - free.shape[1])


def _solved(sums: Sequence[_Sums]) -> tuple[float, float] | None:
    """The gain with its standard deviation, the noise being what the residuals show: a rate of which the accelerometer
    shows less was read too large.
    """
    information = np.sum([one.information for one in sums], axis=0)
    pulled = np.sum([one.pulled for one in sums], axis=0)
    square, dof = sum(one.square for one in sums), sum(one.dof for one in sums)
    mean, precision = _PRIOR[:, 0], np.diag(_PRIOR[:, 1] ** -2.0)
    variance = square / dof
    for _ in range(_ROUNDS):
        whole = information + variance * precision
        found = np.linalg.solve(whole, pulled + variance * precision @ mean)
        variance = max(float(square - 2.0 * found @ pulled + found @ information @ found), 0.0) / dof
    shown, shown_std = float(found[0]), float(np.sqrt(variance * np.linalg.inv(whole)[0, 0]))
    std = hypot(PER_STATED_STD * shown_std, GAIN_STD)
    return (1.0 / shown, std / shown**2) if std <= MOST_STD * shown else None
