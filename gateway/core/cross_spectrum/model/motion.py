"""The equations of motion of a body on two axles, their solution, and its derivatives by each number in them.

The body has a coordinate over the front axle and one over the rear, and with roll a third: the height of its left side
over the wheels' mean. In these the suspension is nearly diagonal. With stiffness D(omega), forces F of the road and
sensors C, the sensors read C D^-1 F per unit of road. Because D is symmetric, a change of any number in it changes the
reading by

    dC u + A (dF - dD u),    u = D^-1 F,  A = C D^-1,

which needs no second solution. half_car and rolling_car give the numbers of a vehicle with its load.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from gateway.records import C128, F64

PAIRS: Final = ((0, 0), (1, 1), (0, 1), (0, 2), (1, 2), (2, 2))
"""Pairs of coordinates, in the order of ``rigid_kg`` and ``carried_kg``. Without roll the first three."""


_OF_AXLES: Final = [
    [PAIRS.index(pair) for pair in pairs] for pairs in (((0, 0), (1, 1)), ((2, 2), (2, 2)), ((0, 2), (1, 2)))
]
"""Where the stiffnesses of front and rear axle are among PAIRS: of both wheels together, against, and coupled."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Distances between the coordinates; half_track_m is None for a body without roll."""

    wheelbase_m: float
    half_track_m: float | None = None


@dataclass(frozen=True, slots=True)
class Numbers:
    """The numbers in the equations of motion of a vehicle with its load, (q, ..., 1).

    For each axle: the rates of springs, dampers, damper mounts and tyres, and the unsprung mass; with roll also the
    difference of left and right spring rates and, for the wheels moving against each other, the factor of the dampers
    and the rate of the bar. rigid_kg, by PAIRS, are masses of the body and carried_kg those of the payload, which moves
    on its floor with a frequency (Hz) and a damping ratio (payload). The sensor has its position behind the front axle
    (m) and the lag of its gyro (s); with roll also its place left of the centre line (m) and the gyro's yaw (rad, to
    the left).
    """

    all: F64

    @classmethod
    def of(cls, *groups: Sequence[float | F64]) -> "Numbers":
        """Front axle (5; with roll 8), rear axle, rigid_kg (3; 6), carried_kg, payload (2) and sensor (2; 4).

        Each a number or (..., 1); they broadcast.
        """
        flat = [one for group in groups for one in group]
        shapes = {one.shape for one in flat if isinstance(one, np.ndarray)}
        shape = np.broadcast_shapes(*shapes) or (1,)
        every = np.empty((len(flat), *shape), np.result_type(*flat))
        for row, one in zip(every, flat, strict=True):
            row[...] = one
        return cls(every)

    @property
    def groups(self) -> tuple[slice, ...]:
        """The slices of these groups."""
        return _UPRIGHT if len(self.all) == _UPRIGHT[-1].stop else _ROLLING

    def group(self, i: int) -> F64:
        """(n, ..., 1) one of the groups."""
        return self.all[self.groups[i]]

    @property
    def axles(self) -> F64:
        """(n, 2, ..., 1) front and rear."""
        return np.array([self.group(FRONT), self.group(REAR)]).swapaxes(0, 1)


FRONT, REAR, RIGID, CARRIED, PAYLOAD, SENSOR = range(6)  # the groups
SPRING, DAMPER, MOUNT, TYRE, UNSPRUNG, UNEVEN, FACTOR, BAR = range(8)  # an axle's numbers


def _slices(*sizes: int) -> tuple[slice, ...]:
    ends = np.cumsum(sizes).tolist()
    return tuple(slice(end - size, end) for end, size in zip(ends, sizes, strict=True))


_UPRIGHT: Final = _slices(5, 5, 3, 3, 2, 2)
_ROLLING: Final = _slices(8, 8, 6, 6, 2, 4)


class _Axles:
    """Stiffness of front and rear axle on the body, and the force of the road on it.

    ``stiffness`` and ``force`` are (1, 2, ..., m), with roll (3, 2, ..., m): for both wheels together, for one against
    the other, and for the coupling of both. With K, K' the suspension together and against, D the left spring's rate
    minus the right one's, T the wheels on their tyres k, and the wheels' own movement eliminated, the stiffness is K T
    / (K + T), K' T / (K' + T) and, to first order in D, D / 2 T / (K + T) T / (K' + T); the force has k in place of one
    T. A suspension is a spring in parallel with a damper on its elastic mount.
    """

    def __init__(self, numbers: F64, omega: F64) -> None:
        spring, self._damper, self._mount, self.tyre, unsprung, *self._rolls = numbers
        spring, damper = spring[None], self._damper[None]
        if self._rolls:
            _, factor, bar = self._rolls
            spring, damper = np.concatenate([spring, spring + bar]), np.concatenate([damper, damper * factor])
        self._turn: C128 = np.multiply(1j, omega)
        self._omega2 = omega**2
        self.wheel = self.tyre - self._omega2 * unsprung
        self._damped = self._turn * damper
        self._yields = 1.0 / (1.0 + self._damped / self._mount)
        self._rates = spring + self._damped * self._yields
        self._softs = 1.0 / (self._rates + self.wheel)
        self.per_tyre = self._rates * self._softs
        if self._rolls:
            self._both = 0.5 * self._softs[0] * self._softs[1] * self.wheel
            self.per_tyre = np.concatenate([self.per_tyre, (self._rolls[0] * self._both)[None]])
        self.stiffness = self.per_tyre * self.wheel
        self.force = self.per_tyre * self.tyre

    def slopes(self, rows: Sequence[int]) -> C128:
        """(k, 1 or 3, 2, ..., m) derivatives by an axle's numbers of the stiffness per wheel: over T."""
        found = np.zeros((len(rows), *self.per_tyre.shape), np.complex128)
        for into, row in zip(found, rows, strict=True):
            if row in (TYRE, UNSPRUNG):
                self._fill_in_by_wheel(into, -self._omega2 if row == UNSPRUNG else 1.0)
            elif row == UNEVEN:
                into[2] = self._both
            else:
                by_rate = self._rates_by(row)
                np.multiply(self.wheel * self._softs**2, by_rate, out=into[: len(self._softs)])
                if self._rolls:
                    np.multiply(-self.per_tyre[2], (self._softs * by_rate).sum(axis=0), out=into[2])
        return found

    def _rates_by(self, row: int) -> C128 | float:
        """(1 or 2, 2, ..., m) derivatives of the suspensions' rates; one for all by the spring's."""
        if row == SPRING:
            return 1.0
        if row == MOUNT:
            return np.asarray((self._damped * self._yields / self._mount) ** 2)
        by_damper: C128 = self._turn * self._yields**2
        if row == DAMPER and self._rolls:
            by_damper[1] *= self._rolls[1]
        elif row in (FACTOR, BAR):
            by_damper[0] = 0.0
            by_damper[1] = 1.0 if row == BAR else by_damper[1] * self._damper
        return by_damper

    def _fill_in_by_wheel(self, into: C128, change: F64 | float) -> None:
        """Derivative of the stiffness per wheel by what changes T by ``change``."""
        np.multiply(-self._rates, change * self._softs**2, out=into[: len(self._rates)])
        if self._rolls:
            one, other = self._softs
            into[2] = change * self._rolls[0] * (0.5 * one * other - self._both * (one + other))


class Supported:
    """A mass on a spring with a damper on a moving support, at ``ratio`` times its own frequency.

    It acts on the support like ``felt`` times itself; its movement is (1 + damping) ``below`` that of the support.
    """

    def __init__(self, ratio: F64, damping_ratio: float | F64) -> None:
        self.ratio = ratio
        self.damping: C128 = np.asarray(2j * damping_ratio * ratio)
        self.below: C128 = 1.0 / (1.0 - ratio**2 + self.damping)
        self.felt: C128 = (1.0 + self.damping) * self.below


class Motion:
    """The equations of one or many vehicles, solved at frequencies (m,) > 0.

    Coordinates are c = 2, or 3 with roll; ways s = 2 (both tracks alike under the front axle, under the rear one), with
    roll 4 (then one track against the other). Sensors are vertical acceleration, pitch rate (nose down) and with roll
    the roll rate, of which the first ``n_sensors`` count.
    """

    def __init__(self, numbers: Numbers, frame: Frame, freq_hz: F64, n_sensors: int) -> None:
        self._numbers, self._frame, self._omega = numbers, frame, 2.0 * np.pi * freq_hz
        self._axles = _Axles(numbers.axles, self._omega)
        self._mode_hz, damping_ratio = numbers.group(PAYLOAD)
        self._payload = Supported(freq_hz / self._mode_hz, damping_ratio)
        self._carried_kg = numbers.group(CARRIED)
        self._pairs = PAIRS[: len(self._carried_kg)]
        compliance = self._compliance()
        self.body = self._body(compliance)
        """(c, s, ..., m) displacement of the body at each coordinate per unit of road."""
        sensors = self._rows(n_sensors)
        self.paths: C128 = _product(sensors, self.body)
        """(p, s, ..., m) sensor readings per unit of road."""
        self._by_force = _product(sensors, compliance)

    def slopes(self, wanted: Sequence[int]) -> C128:
        """(..., k, p, s, m) derivatives of the paths by the ``wanted`` entries of ``Numbers.all``, in rising order."""
        p, s, *several, m = self.paths.shape
        found = np.empty((*several, len(wanted), p, s, m), np.complex128)
        by_number = np.moveaxis(found, range(len(several)), range(3, 3 + len(several)))
        groups = [[i - one.start for i in wanted if one.start <= i < one.stop] for one in self._numbers.groups]
        ends = np.cumsum([len(rows) for rows in groups])
        parts = [by_number[end - len(rows) : end] for rows, end in zip(groups, ends, strict=True)]
        self._fill_in_by_axles(parts[FRONT], groups[FRONT], parts[REAR], groups[REAR])
        omega2 = self._omega**2
        np.multiply(self._moved[groups[RIGID]], omega2, out=parts[RIGID])
        np.multiply(self._moved[groups[CARRIED]], omega2 * self._payload.felt, out=parts[CARRIED])
        self._fill_in_by_felt(parts[PAYLOAD], groups[PAYLOAD])
        self._fill_in_by_sensor(parts[SENSOR], groups[SENSOR])
        return found

    def by_suspended_mass(self, behind_m: float, felt: C128) -> C128:
        """(..., k, p, s, m) derivatives of the paths by a mass (kg) in the body's middle plane, ``behind_m`` behind the
        front axle, that acts on the body like ``felt`` (k, m) times itself.
        """
        rear = behind_m / self._frame.wheelbase_m
        front = 1.0 - rear
        on_front, on_rear, on_both = self._moved[:3]
        at_place = front**2 * on_front + rear**2 * on_rear + front * rear * on_both
        per_kg = np.moveaxis(at_place * self._omega**2, (0, 1), (-3, -2))
        slopes: C128 = per_kg[..., None, :, :, :] * felt[:, None, None]
        return slopes

    def _compliance(self) -> C128:
        """(c, c, ..., m) the inverse of the stiffness; roll is eliminated first."""
        stiffness = self._axles.stiffness
        inertia = self._omega**2 * (self._numbers.group(RIGID) + self._payload.felt * self._carried_kg)
        d_ff, d_rr, d_fr = stiffness[0, 0] - inertia[0], stiffness[0, 1] - inertia[1], -inertia[2]
        if len(inertia) == 3:
            per_determinant = 1.0 / (d_ff * d_rr - d_fr**2)
            solved: C128 = np.array([[d_rr, -d_fr], [-d_fr, d_ff]]) * per_determinant
            return solved
        d_pp = stiffness[1, 0] + stiffness[1, 1] - inertia[5]
        coupled = stiffness[2] - inertia[3:5]
        by_f, by_r = coupled / d_pp
        d_ff, d_rr, d_fr = d_ff - by_f * coupled[0], d_rr - by_r * coupled[1], d_fr - by_f * coupled[1]
        per_determinant = 1.0 / (d_ff * d_rr - d_fr**2)
        e_ff, e_rr, e_fr = d_rr * per_determinant, d_ff * per_determinant, -d_fr * per_determinant
        e_fp, e_rp = -by_f * e_ff - by_r * e_fr, -by_f * e_fr - by_r * e_rr
        e_pp = 1.0 / d_pp - by_f * e_fp - by_r * e_rp
        return np.array([[e_ff, e_fr, e_fp], [e_fr, e_rr, e_rp], [e_fp, e_rp, e_pp]])

    def _body(self, compliance: C128) -> C128:
        """(c, s, ..., m)."""
        force = self._axles.force
        together: C128 = compliance[:, :2] * force[0]
        if len(compliance) == 2:
            return together
        roll = compliance[:, 2, None]
        against = compliance[:, :2] * force[2] + roll * force[1]
        both: C128 = np.concatenate([together + roll * force[2], against], axis=1)
        return both

    def _late(self) -> C128:
        """The gyro's reading per angle, with its lag."""
        turn: C128 = np.multiply(1j, self._omega)
        late: C128 = turn * np.exp(-turn * self._numbers.group(SENSOR)[1])
        return late

    def _rows(self, n_sensors: int) -> C128:
        """(p, c, ..., m) sensor readings per coordinate."""
        position_m, _, *mounted = self._numbers.group(SENSOR)
        heave, late = -(self._omega**2), self._late()
        behind = position_m / self._frame.wheelbase_m
        pitch = late / self._frame.wheelbase_m
        rows = [[heave * (1.0 - behind), heave * behind], [-pitch, pitch]]
        if self._frame.half_track_m is not None:
            left_m, yaw_rad = mounted
            roll = late / self._frame.half_track_m
            rows[0].append(heave * left_m / self._frame.half_track_m)
            rows[1].append(-yaw_rad * roll)
            rows.append([-yaw_rad * pitch, yaw_rad * pitch, roll])
        found = np.empty((n_sensors, len(rows[0]), *self._payload.felt.shape), np.complex128)
        for into, row in zip(found, rows, strict=False):
            for coordinate, one in zip(into, row, strict=True):
                coordinate[...] = one
        return found

    @cached_property
    def _moved(self) -> C128:
        """(q, p, s, ..., m) what less stiffness between each of PAIRS does to the paths."""
        by_both = self._by_force.swapaxes(0, 1)[:, None, :, None] * self.body[:, None]
        moved = np.empty((len(self._pairs), *self.paths.shape), np.complex128)
        for into, (a, b) in zip(moved, self._pairs, strict=True):
            if a == b:
                into[...] = by_both[a, a]
            else:
                np.add(by_both[a, b], by_both[b, a], out=into)
        return moved

    @cached_property
    def _by_per_tyre(self) -> C128:
        """(1 or 3, 2, p, s, ..., m) derivatives of the paths by the stiffness of front and rear axle per wheel: by the
        road's force, less by the body's movement.
        """
        found: C128 = -self._axles.wheel[:, None, None] * self._moved[_OF_AXLES[: len(self._axles.force)]]
        for i, tyre in enumerate(self._axles.tyre):
            own = tyre * self._by_force[:, i]
            found[0, i, :, i] += own
            if len(found) > 1:
                roll = tyre * self._by_force[:, 2]
                found[1, i, :, i + 2] += roll
                found[2, i, :, i] += roll
                found[2, i, :, i + 2] += own
        return found

    def _fill_in_by_axles(self, front: C128, of_front: Sequence[int], rear: C128, of_rear: Sequence[int]) -> None:
        """Slopes by some numbers of both axles."""
        axles, by = self._axles, self._by_per_tyre
        rows = sorted({*of_front, *of_rear})
        per_tyre = axles.slopes(rows)
        for i, (into, of) in enumerate(((front, of_front), (rear, of_rear))):
            slopes = (per_tyre if rows == of else per_tyre[[rows.index(row) for row in of]])[:, :, i, None, None]
            found = slopes[:, 0] * by[0, i]
            for t in range(1, len(by)):
                found += slopes[:, t] * by[t, i]
            into[...] = found
            still = axles.per_tyre[:, i, None, None]
            if UNSPRUNG in of or TYRE in of:
                inert = self._omega**2 * (still * self._moved[[pairs[i] for pairs in _OF_AXLES[: len(by)]]]).sum(axis=0)
            if UNSPRUNG in of:
                into[of.index(UNSPRUNG)] += inert
            if TYRE in of:
                unsprung = (axles.tyre[i] - axles.wheel[i]) / self._omega**2
                into[of.index(TYRE)] += ((still * by[:, i]).sum(axis=0) - unsprung * inert) / axles.tyre[i]

    def _fill_in_by_felt(self, into: C128, rows: Sequence[int]) -> None:
        """By frequency and damping ratio of the payload on its floor."""
        if not rows:
            return
        carried = sum(kg * one for kg, one in zip(self._carried_kg, self._moved, strict=True))
        on_floor = self._payload
        felt = -(on_floor.ratio**2) * on_floor.below**2 * self._omega**2
        for one, row in zip(into, rows, strict=True):
            by = felt * (2.0 + on_floor.damping) / self._mode_hz if row == 0 else felt * 2j * on_floor.ratio
            np.multiply(carried, by, out=one)

    def _fill_in_by_sensor(self, into: C128, rows: Sequence[int]) -> None:
        """By its position, the gyro's lag and, with roll, its place left of the centre line and the gyro's yaw."""
        for one, row in zip(into, rows, strict=True):
            one[...] = 0.0
            if row == 0:
                one[0] = -(self._omega**2) / self._frame.wheelbase_m * (self.body[1] - self.body[0])
            elif row == 1:
                np.multiply(-1j * self._omega, self.paths[1:], out=one[1:])
            elif self._frame.half_track_m is not None:
                roll, late = self.body[2] / self._frame.half_track_m, self._late()
                if row == 2:
                    one[0] = -(self._omega**2) * roll
                else:
                    one[1] = -late * roll
                    one[2:] = late / self._frame.wheelbase_m * (self.body[1] - self.body[0])


def _product(rows: C128, columns: C128) -> C128:
    """(p, s, ...) of matrices (p, c, ...) and (c, s, ...)."""
    return np.asarray(sum(rows[:, i, None] * columns[i] for i in range(len(columns))), np.complex128)
