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
from typing import Final

import numpy as np

from gateway.records import C128, F64

PAIRS: Final = ((0, 0), (1, 1), (0, 1), (0, 2), (1, 2), (2, 2))
"""Pairs of coordinates, in the order of ``rigid_kg`` and ``carried_kg``. Without roll the first three."""


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
        shape = np.broadcast_shapes(*{np.shape(one) for one in flat}) or (1,)
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
        return np.stack([self.group(FRONT), self.group(REAR)], axis=1)


FRONT, REAR, RIGID, CARRIED, PAYLOAD, SENSOR = range(6)  # the groups
SPRING, DAMPER, MOUNT, TYRE, UNSPRUNG, UNEVEN, FACTOR, BAR = range(8)  # an axle's numbers


def _slices(*sizes: int) -> tuple[slice, ...]:
    ends = np.cumsum(sizes).tolist()
    return tuple(slice(end - size, end) for end, size in zip(ends, sizes, strict=True))


_UPRIGHT: Final = _slices(5, 5, 3, 3, 2, 2)
_ROLLING: Final = _slices(8, 8, 6, 6, 2, 4)


class _Suspension:
    """Springs in parallel with dampers on their elastic mounts: ``rate``, and its slopes by damper and mount."""

    def __init__(self, spring: F64, damper: F64, mount: F64, omega: F64) -> None:
        self._mount = mount
        self._turn: C128 = np.multiply(1j, omega)
        self._damped: C128 = self._turn * damper
        self._yields: C128 = 1.0 / (1.0 + self._damped / mount)
        self.rate = spring + self._damped * self._yields

    @property
    def by_damper(self) -> C128:
        slope: C128 = self._turn * self._yields**2
        return slope

    @property
    def by_mount(self) -> C128:
        root: C128 = self._damped * self._yields / self._mount
        return root * root


class _Axles:
    """Stiffness of front and rear axle on the body, and the force of the road on it.

    ``stiffness`` and ``force`` are (1, 2, ..., m), with roll (3, 2, ..., m): for both wheels together, for one against
    the other, and for the coupling of both. With K, K' the suspension together and against, D the left spring's rate
    minus the right one's, T the wheels on their tyres k, and the wheels' own movement eliminated, the stiffness is K T
    / (K + T), K' T / (K' + T) and, to first order in D, D / 2 T / (K + T) T / (K' + T); the force has k in place of one
    T.
    """

    def __init__(self, numbers: F64, omega: F64) -> None:
        spring, damper, mount, self._tyre, unsprung, *self._rolls = numbers
        self._damper, self._omega2 = damper, omega**2
        self._wheel = self._tyre - self._omega2 * unsprung
        self._ways = [_Suspension(spring, damper, mount, omega)]
        if self._rolls:
            _, factor, bar = self._rolls
            self._ways.append(_Suspension(spring + bar, damper * factor, mount, omega))
        self._softs = [1.0 / (way.rate + self._wheel) for way in self._ways]
        per_tyre = [way.rate * soft for way, soft in zip(self._ways, self._softs, strict=True)]
        if self._rolls:
            self._both = 0.5 * self._softs[0] * self._softs[1] * self._wheel
            per_tyre.append(self._rolls[0] * self._both)
        self._per_tyre = np.stack(per_tyre)
        self.stiffness = self._per_tyre * self._wheel
        self.force = self._per_tyre * self._tyre

    def slopes(self, rows: Sequence[int]) -> tuple[C128, C128]:
        """(k, 1 or 3, 2, ..., m) derivatives of stiffness and force by an axle's numbers."""
        per_tyre = np.zeros((len(rows), *self._per_tyre.shape), np.complex128)
        by_rate = [self._by_rate(i) for i in range(len(self._ways))]
        by_wheel = self._by_wheel()
        for into, row in zip(per_tyre, rows, strict=True):
            if row == SPRING:
                into[:] = sum(by_rate)
            elif row == DAMPER:
                factors = (1.0, *self._rolls[1:2])
                parts = zip(self._ways, by_rate, factors, strict=True)
                into[:] = sum(by * (way.by_damper * factor) for way, by, factor in parts)
            elif row == MOUNT:
                into[:] = sum(by * way.by_mount for way, by in zip(self._ways, by_rate, strict=True))
            elif row in (TYRE, UNSPRUNG):
                into[:] = by_wheel if row == TYRE else -self._omega2 * by_wheel
            elif row == UNEVEN:
                into[2] = self._both
            else:
                into[:] = by_rate[1] * (self._ways[1].by_damper * self._damper if row == FACTOR else 1.0)
        stiffness, force = per_tyre * self._wheel, per_tyre * self._tyre
        for i, row in enumerate(rows):
            if row == TYRE:
                stiffness[i] += self._per_tyre
                force[i] += self._per_tyre
            elif row == UNSPRUNG:
                stiffness[i] -= self._omega2 * self._per_tyre
        return stiffness, force

    def _by_rate(self, i: int) -> C128:
        """Derivative of the stiffness per wheel by the rate of one suspension."""
        found = np.zeros_like(self._per_tyre)
        found[i] = self._wheel * self._softs[i] ** 2
        if self._rolls:
            found[2] = -self._per_tyre[2] * self._softs[i]
        return found

    def _by_wheel(self) -> C128:
        """Derivative of the stiffness per wheel by T."""
        found = np.empty_like(self._per_tyre)
        for i, (way, soft) in enumerate(zip(self._ways, self._softs, strict=True)):
            found[i] = -way.rate * soft**2
        if self._rolls:
            one, other = self._softs
            found[2] = self._rolls[0] * (0.5 * one * other - self._both * (one + other))
        return found


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
        self._ratio = freq_hz / self._mode_hz
        self._damping = 2j * damping_ratio * self._ratio
        self._below = 1.0 / (1.0 - self._ratio**2 + self._damping)
        self._felt = (1.0 + self._damping) * self._below  # factor of the payload's apparent mass
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
        moved, omega2 = self._moved(), self._omega**2
        groups = [[i - one.start for i in wanted if one.start <= i < one.stop] for one in self._numbers.groups]
        of_axles = sorted({*groups[FRONT], *groups[REAR]})
        stiffness, force = self._axles.slopes(of_axles)
        start = 0
        for group, rows in enumerate(groups):
            into, start = by_number[start : start + len(rows)], start + len(rows)
            if group in (FRONT, REAR):
                at = [of_axles.index(row) for row in rows]
                self._by_axle(into, group, stiffness[at, :, None, None, group], force[at, :, None, group], moved)
            elif group in (RIGID, CARRIED):
                np.multiply(moved[rows], omega2 if group == RIGID else omega2 * self._felt, out=into)
            elif group == PAYLOAD and rows:
                into[:] = self._by_felt(moved)[rows]
            elif group == SENSOR:
                into[:] = self._by_sensor()[rows]
        return found

    def by_suspended_mass(self, behind_m: float, felt: C128) -> C128:
        """(..., k, p, s, m) derivatives of the paths by a mass (kg) in the body's middle plane, ``behind_m`` behind the
        front axle, that acts on the body like ``felt`` (k, m) times itself.
        """
        rear = behind_m / self._frame.wheelbase_m
        front = 1.0 - rear
        on_front, on_rear, on_both = self._moved()[:3]
        at_place = front**2 * on_front + rear**2 * on_rear + front * rear * on_both
        per_kg = np.moveaxis(at_place * self._omega**2, (0, 1), (-3, -2))
        slopes: C128 = per_kg[..., None, :, :, :] * felt[:, None, None]
        return slopes

    def _compliance(self) -> C128:
        """(c, c, ..., m) the inverse of the stiffness; roll is eliminated first."""
        stiffness = self._axles.stiffness
        inertia = self._omega**2 * (self._numbers.group(RIGID) + self._felt * self._carried_kg)
        d_ff, d_rr, d_fr = stiffness[0, 0] - inertia[0], stiffness[0, 1] - inertia[1], -inertia[2]
        if len(inertia) == 3:
            per_determinant = 1.0 / (d_ff * d_rr - d_fr**2)
            solved: C128 = np.stack([d_rr, -d_fr, -d_fr, d_ff]).reshape(2, 2, *d_ff.shape) * per_determinant
            return solved
        d_pp = stiffness[1, 0] + stiffness[1, 1] - inertia[5]
        coupled = stiffness[2] - inertia[3:5]
        by_f, by_r = coupled / d_pp
        d_ff, d_rr, d_fr = d_ff - by_f * coupled[0], d_rr - by_r * coupled[1], d_fr - by_f * coupled[1]
        per_determinant = 1.0 / (d_ff * d_rr - d_fr**2)
        e_ff, e_rr, e_fr = d_rr * per_determinant, d_ff * per_determinant, -d_fr * per_determinant
        e_fp, e_rp = -by_f * e_ff - by_r * e_fr, -by_f * e_fr - by_r * e_rr
        e_pp = 1.0 / d_pp - by_f * e_fp - by_r * e_rp
        rows = [e_ff, e_fr, e_fp, e_fr, e_rr, e_rp, e_fp, e_rp, e_pp]
        return np.reshape(np.stack(rows), (3, 3, *e_ff.shape))

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
        found = np.empty((n_sensors, len(rows[0]), *self._felt.shape), np.complex128)
        for into, row in zip(found, rows, strict=False):
            for coordinate, one in zip(into, row, strict=True):
                coordinate[...] = one
        return found

    def _moved(self) -> C128:
        """(q, p, s, ..., m) what less stiffness between each of PAIRS does to the paths."""
        one, other = (list(each) for each in zip(*self._pairs, strict=True))
        by_force = self._by_force.swapaxes(0, 1)[:, :, None]
        moved: C128 = by_force[one] * self.body[other][:, None]
        apart = [pair for pair, (a, b) in enumerate(self._pairs) if a != b]
        moved[apart] += by_force[[other[pair] for pair in apart]] * self.body[[one[pair] for pair in apart]][:, None]
        return moved

    def _by_axle(self, into: C128, i: int, stiffness: C128, force: C128, moved: C128) -> None:
        """Slopes by some numbers of an axle, from those of its stiffness and force."""
        np.multiply(stiffness[:, 0], -moved[PAIRS.index((i, i))], out=into)
        into[:, :, i] += force[:, 0] * self._by_force[:, i]
        if stiffness.shape[1] > 1:
            into -= stiffness[:, 1] * moved[PAIRS.index((2, 2))]
            into -= stiffness[:, 2] * moved[PAIRS.index((i, 2))]
            into[:, :, i] += force[:, 2] * self._by_force[:, 2]
            into[:, :, i + 2] += force[:, 2] * self._by_force[:, i] + force[:, 1] * self._by_force[:, 2]

    def _by_felt(self, moved: C128) -> C128:
        """By frequency and damping ratio of the payload on its floor."""
        carried = sum(kg * one for kg, one in zip(self._carried_kg, moved, strict=True))
        felt = -(self._ratio**2) * self._below**2 * self._omega**2
        return np.stack([carried * (felt * (2.0 + self._damping) / self._mode_hz), carried * (felt * 2j * self._ratio)])

    def _by_sensor(self) -> C128:
        found = np.zeros((len(self._numbers.group(SENSOR)), *self.paths.shape), np.complex128)
        pitch = (self.body[1] - self.body[0]) / self._frame.wheelbase_m
        found[0, 0] = -(self._omega**2) * pitch
        found[1, 1:] = -1j * self._omega * self.paths[1:]
        if self._frame.half_track_m is not None:
            roll, late = self.body[2] / self._frame.half_track_m, self._late()
            found[2, 0] = -(self._omega**2) * roll
            found[3, 1] = -late * roll
            found[3, 2:] = late * pitch
        return found


def _product(rows: C128, columns: C128) -> C128:
    """(p, s, ...) of matrices (p, c, ...) and (c, s, ...)."""
    return np.asarray(sum(rows[:, i, None] * columns[i] for i in range(len(columns))), np.complex128)
