"""The gyro's gain, measured in bends, where yaw also causes lateral acceleration.

    gyro_gain_of(Bends(lateral_acceleration_mps2, yaw_rate_radps, ...), usable, rate_hz) -> (gain, std) | None

In a bend the accelerometer reads speed times yaw rate plus g times the roll angle, the integral of the roll rate. So
bends compare the gyro with the accelerometer, and gravity checks the accelerometer.
One device measures all three rates, so a change of gain is assumed to be common to them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Final

import numpy as np

from gateway.core.spectrum import runs_of
from gateway.records import F64, Bool
from gateway.units import STANDARD_GRAVITY_MPS2

BLOCK_S: Final = 1.0  # chosen: means over 1 s average out suspension and engine
LEAST_PIECE_S: Final = 20.0  # chosen: in a shorter piece the parabola would absorb the bends
MOST_PIECE_S: Final = 60.0  # chosen: over this time a parabola still follows the drift of a gyro's bias
LEAST_S: Final = 60.0  # chosen: usable driving below which a batch gives no gain
PER_STATED_STD: Final = 1.5  # chosen: allows for the correlation of neighbouring residuals
GAIN_STD: Final = 0.004
"""Added to the standard deviation that a batch's residuals give: the scatter of recorded drives of one sensor
(docs/method.md).
"""
MOST_STD: Final = 0.015  # chosen: a batch with a larger standard deviation has too few bends

_PRIOR: Final = np.array(
    [
        [1.0, 1e3],  # speed times yaw rate: the unknown of interest
        [1.0, 0.03],  # g times the integral of the roll rate: the gain of another axis
        [0.0, 0.05],  # g times that of the yaw rate: the gyro's z axis is tilted, 3 degrees
        [0.0, 0.06],  # change of speed: the accelerometer is turned, 3.4 degrees
        [0.0, 3.0],  # yaw acceleration: distance (m) of the sensor from the point without side slip
    ]
)
"""Prior mean and standard deviation of each coefficient; chosen: wider than any mount."""
_ROUNDS: Final = 4  # iterations over noise and coefficients; the third no longer changes the stored digits


@dataclass(frozen=True, slots=True)
class Bends:
    """Arrays (n,) in vehicle axes (ISO 8855): y left, roll positive left side up, yaw positive nose left; NaN if
    unknown.
    """

    lateral_acceleration_mps2: F64
    yaw_rate_radps: F64
    roll_rate_radps: F64
    speed_mps: F64


@dataclass(frozen=True, slots=True)
class _NormalEquations:
    """A'A (k, k), A'y (k,), y'y and the degrees of freedom of a least-squares problem."""

    information: F64
    pulled: F64
    square: float
    dof: int


def gyro_gain_of(bends: Bends, usable: Bool, rate_hz: float) -> tuple[float, float] | None:
    """The gyro's gain relative to the accelerometer's, and its standard deviation; None if too little was driven in
    bends.

    Least squares over means of BLOCK_S. Each piece without gaps has its own parabola and its own multiple of the speed:
    they model the sensors' biases and the banking of the road.
    """
    sensed = np.array([bends.lateral_acceleration_mps2, bends.yaw_rate_radps, bends.roll_rate_radps, bends.speed_mps])
    known = usable & np.isfinite(sensed).all(axis=0)
    pieces = list(_pieces(known, rate_hz))
    if sum(len(range(*one.indices(len(known)))) for one in pieces) < LEAST_S * rate_hz:
        return None
    sums = [_normal_equations(sensed[:, one], rate_hz) for one in pieces]
    return _solved(sums)


def joined_gains(gains: Sequence[tuple[float, float] | None]) -> tuple[float, float] | None:
    """The mean of several gains, weighted by precision; None if none is known."""
    known = np.array([one for one in gains if one is not None])
    if not len(known):
        return None
    precision = known[:, 1] ** -2.0
    return float(precision @ known[:, 0] / precision.sum()), float(precision.sum() ** -0.5)


def _pieces(known: Bool, rate_hz: float) -> Iterator[slice]:
    """Stretches without gaps; long ones are cut into equal pieces."""
    for begin, end in runs_of(known).tolist():
        if end - begin >= LEAST_PIECE_S * rate_hz:
            cuts = np.linspace(begin, end, int(np.ceil((end - begin) / (MOST_PIECE_S * rate_hz))) + 1).astype(int)
            yield from (slice(a, b) for a, b in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True))


def _normal_equations(sensed: F64, rate_hz: float) -> _NormalEquations:
    """The normal equations of one piece of lateral acceleration, yaw rate, roll rate and speed (4, n)."""
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
    return _NormalEquations(told.T @ told, told.T @ pushed, float(pushed @ pushed), m - free.shape[1])


def _solved(sums: Sequence[_NormalEquations]) -> tuple[float, float] | None:
    """The gain and its standard deviation, with the noise taken from the residuals. If the accelerometer shows less
    than the gyro reads, the gyro's gain is above 1.
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
