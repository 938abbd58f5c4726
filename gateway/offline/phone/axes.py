"""The vehicle's axes in a phone of any orientation: up by gravity, forward by braking and bends, the sign by the
course.

With the specific force f and the turn rate w in the phone's axes, up is the mean of f. For the horizontal part h of f,
as a complex number in two axes perpendicular to up, a vehicle has

    h(t) = exp(j angle) (dv/dt + j v w_up)

because it accelerates along its forward axis and towards the inside of a bend. The angle of forward is the argument of
sum(h conj(b)), b being the bracket: one answer from braking and bends together (orthogonal Procrustes in the plane; P.
H. Schoenemann, Psychometrika 31, 1966). A receiver's speed is delayed; the delay with the best fit is estimated too.

A recording with all three accelerations inverted gives the same vertical acceleration and pitch rate, but the opposite
roll and yaw rate. Only the receiver's course, which falls in a turn to the left, distinguishes the two.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from gateway.offline.look.roles import LEAST_CORRELATION
from gateway.offline.phone.tables import Fixes, Vectors
from gateway.records import C128, F64, Bool
from gateway.units import NS_PER_S

MOVING_MPS: Final = 3.0  # chosen: above a receiver's noise
LEAST_INTERVALS: Final = 40  # chosen: between fixes, while the vehicle moves
LEAST_BENDS: Final = 10  # chosen: intervals in bends
LATEST_S: Final = 3.0  # chosen: largest delay of a receiver
DELAY_STEP_S: Final = 0.1  # chosen: grid of delays
LONGEST_S: Final = 5.0  # chosen: from a fix to the next but one
LEAST_TURN_RADPS: Final = 0.02  # chosen: of the course; above a receiver's noise


@dataclass(frozen=True, slots=True)
class Axes:
    """The vehicle's axes in the phone.

    to_vehicle (3, 3): its rows are forward, left and up in the phone's axes. gravity_mps2 as the phone reads it. fit
    0..1: share of the horizontal acceleration that braking and bends explain; NaN if forward was given. compass -1..1:
    correlation of the turn rate about up with the course to the left; NaN without enough bends.
    """

    to_vehicle: F64
    gravity_mps2: float
    fit: float
    delay_s: float
    compass: float


def axes_of(accel: Vectors, gyro: Vectors, fixes: Fixes, forward: F64 | None = None) -> Axes | None:
    """Axes of a phone that lay still; ``forward`` (3,) is the phone's axis that points ahead, if given.

    None if neither a person nor the drive gives it.
    """
    down_to_up = accel.xyz.mean(axis=0)
    gravity = float(np.linalg.norm(down_to_up))
    up = down_to_up / gravity
    basis = _horizontal(up)
    felt = FixIntervals.of(accel, gyro, fixes, up, basis)
    compass = felt.compass() if felt is not None else np.nan
    if forward is not None:
        ahead = forward - up * (forward @ up)
        length = float(np.linalg.norm(ahead))
        return None if length < 0.5 else Axes(_rows(ahead / length, up), gravity, np.nan, 0.0, compass)
    if felt is None:
        return None
    angle, fit, delay_s = felt.forward()
    if fit < LEAST_CORRELATION:
        return None
    ahead = np.cos(angle) * basis[0] + np.sin(angle) * basis[1]
    return Axes(_rows(ahead, up), gravity, fit, delay_s, compass)


def _rows(forward: F64, up: F64) -> F64:
    rows: F64 = np.stack([forward, np.cross(up, forward), up])
    return rows


def _horizontal(up: F64) -> F64:
    """(2, 3) two axes perpendicular to up and to each other, right-handed with it."""
    least = np.eye(3)[int(np.argmin(np.abs(up)))]
    first = np.cross(least, up)
    first /= np.linalg.norm(first)
    basis: F64 = np.stack([first, np.cross(up, first)])
    return basis


@dataclass(frozen=True, slots=True)
class FixIntervals:
    """The phone's readings and the receiver's, between each fix with a speed and the next but one.

    felt_s (n,) and its running integrals: horizontal [m/s] complex, turned [rad] about up; fix_s (m,), speed_mps (m,),
    course_rad (m,) to the left, unwrapped, NaN if unknown. Seconds from the phone's first sample.
    """

    felt_s: F64
    horizontal: C128
    turned_s: F64
    turned: F64
    fix_s: F64
    speed_mps: F64
    course_rad: F64

    @staticmethod
    def of(accel: Vectors, gyro: Vectors, fixes: Fixes, up: F64, basis: F64) -> "FixIntervals | None":
        """None if the drive is too short."""
        has_speed = np.isfinite(fixes.speed_mps)
        if np.count_nonzero(has_speed) < LEAST_INTERVALS or len(accel.t_ns) < 2 or len(gyro.t_ns) < 2:
            return None
        origin_ns = accel.t_ns[0]
        plane = accel.xyz @ basis.T
        turn = gyro.xyz @ up
        course = np.full(len(fixes.t_ns), np.nan)
        told = np.isfinite(fixes.bearing_deg) & (fixes.speed_mps > MOVING_MPS)
        course[told] = -np.unwrap(np.radians(fixes.bearing_deg[told]))
        felt_s, turned_s = (accel.t_ns - origin_ns) / NS_PER_S, (gyro.t_ns - origin_ns) / NS_PER_S
        return FixIntervals(
            felt_s,
            _integral(felt_s, plane[:, 0] + 1j * plane[:, 1]),
            turned_s,
            _integral(turned_s, turn - np.median(turn)),
            (fixes.t_ns[has_speed] - origin_ns) / NS_PER_S,
            fixes.speed_mps[has_speed],
            course[has_speed],
        )

    def forward(self) -> tuple[float, float, float]:
        """Angle of forward in the basis, its fit 0..1 (0 without evidence), and the delay of the speed."""
        tried = [(delay_s, self._correlation(delay_s)) for delay_s in np.arange(0.0, LATEST_S, DELAY_STEP_S)]
        delay_s, best = max(tried, key=lambda each: abs(each[1]))
        return float(np.angle(best)), abs(best), float(delay_s)

    def compass(self) -> float:
        """Correlation of the turn about up with that of the course, in bends; NaN if there are too few."""
        begin_s, end_s = self.fix_s[:-2], self.fix_s[2:]
        turn = np.interp(end_s, self.turned_s, self.turned) - np.interp(begin_s, self.turned_s, self.turned)
        course = self.course_rad[2:] - self.course_rad[:-2]
        chosen = self._is_whole(0.0) & np.isfinite(course) & (np.abs(course) > LEAST_TURN_RADPS * (end_s - begin_s))
        if np.count_nonzero(chosen) < LEAST_BENDS or np.ptp(course[chosen]) == 0.0 or np.ptp(turn[chosen]) == 0.0:
            return float("nan")
        return float(np.corrcoef(course[chosen], turn[chosen])[0, 1])

    def _correlation(self, delay_s: float) -> complex:
        """Correlation of the horizontal acceleration with the expected one, from bends and the speed delayed by
        ``delay_s``.
        """
        begin_s, end_s = self.fix_s[:-2] - delay_s, self.fix_s[2:] - delay_s
        span_s = end_s - begin_s
        h = (np.interp(end_s, self.felt_s, self.horizontal) - np.interp(begin_s, self.felt_s, self.horizontal)) / span_s
        turn = (np.interp(end_s, self.turned_s, self.turned) - np.interp(begin_s, self.turned_s, self.turned)) / span_s
        speed = self.speed_mps[1:-1]
        asked = (self.speed_mps[2:] - self.speed_mps[:-2]) / span_s + 1j * speed * turn
        chosen = self._is_whole(delay_s) & (speed > MOVING_MPS)
        if np.count_nonzero(chosen) < LEAST_INTERVALS:
            return 0j
        h, asked = h[chosen] - h[chosen].mean(), asked[chosen] - asked[chosen].mean()
        scale = float(np.sqrt(np.sum(np.abs(h) ** 2) * np.sum(np.abs(asked) ** 2)))
        return complex(np.sum(h * np.conj(asked)) / scale) if scale > 0.0 else 0j

    def _is_whole(self, delay_s: float) -> Bool:
        """(m - 2,) intervals without a missing fix, covered by the phone's recording."""
        begin_s, end_s = self.fix_s[:-2] - delay_s, self.fix_s[2:] - delay_s
        inside = (begin_s >= max(self.felt_s[0], self.turned_s[0])) & (end_s <= min(self.felt_s[-1], self.turned_s[-1]))
        n_samples = np.searchsorted(self.felt_s, end_s) - np.searchsorted(self.felt_s, begin_s)
        usual = (end_s - begin_s) / np.median(np.diff(self.felt_s))
        whole: Bool = inside & (end_s - begin_s <= LONGEST_S) & (n_samples > 0.9 * usual)
        return whole


def _integral(t_s: F64, x: Any) -> Any:
    """(n,) integral by the trapezoidal rule, 0 at the first sample."""
    return np.concatenate(([0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(t_s))))
