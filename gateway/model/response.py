"""The equations of motion solved at all frequencies and levels, and the derivatives of what the sensors read.

With stiffness D(omega), forces F of the road and sensors C, the sensors read C D^-1 F per unit of road. A change of any
number in it changes the reading by

    dC u + A (dF - dD u),    u = D^-1 F,  A = C D^-1,

which needs no second solution. Shapes: c coordinates (2; 3 with roll), s ways in which the road comes (2: both tracks
alike under the front axle, under the rear one; with roll 4, the last two one track against the other), p sensors
(vertical acceleration, pitch rate positive nose down, roll rate), k points, 5 levels, m frequencies. What is the same
at every level has one of them.
"""

from functools import cached_property
from typing import Final

import numpy as np

from gateway.model import car
from gateway.model.buffers import complex_buffer
from gateway.model.car import Ground
from gateway.records import C128, F64, I64, Bool

PAIRS: Final = ((0, 0), (1, 1), (0, 1), (0, 2), (1, 2), (2, 2))
"""Pairs of coordinates in the order of the masses."""
_MASSES: Final = ((car.RIGID, car.CARRIED, PAIRS[:3]), (car.RIGID_ROLL, car.CARRIED_ROLL, PAIRS[3:]))


_OF_MASSES: Final = np.r_[car.MODE, car.DAMPING, car.RIGID, car.CARRIED, car.RIGID_ROLL, car.CARRIED_ROLL]
_OF_SENSORS: Final = np.r_[car.POSITION, car.LAG, car.GAIN, car.LEFT, car.YAW]
_OF_AXLES: Final = np.setdiff1d(np.arange(car.N_ROLLING), np.r_[_OF_MASSES, _OF_SENSORS])


class Frequencies:
    """m frequencies > 0 with what is computed of them once.

    Numbers that are multiplied with complex ones are complex here and in Motion: numpy would convert them each time.
    """

    def __init__(self, freq_hz: F64) -> None:
        self.hz: C128 = np.asarray(freq_hz, complex)
        self.omega: F64 = 2.0 * np.pi * freq_hz
        self.turn: C128 = np.asarray(1j * self.omega, complex)
        self.omega2: C128 = np.asarray(self.omega**2, complex)


class Motion:
    """Vehicles of these numbers (23 or 37, k, 5) on unit roads.

    With K, K' the suspension of an axle together and against, D the left spring's rate minus the right one's, T the
    wheels on their tyres t, and the wheels' own movement eliminated, its stiffness is K T / (K + T), K' T / (K' + T)
    and, for the coupling of both ways, to first order in D, D / 2 T / (K + T) T / (K' + T): each is a ratio
    ``per_tyre`` times T. The force of the road has t in place of that T. A suspension is a spring in parallel with a
    damper on its elastic mount. The payload acts on its floor like ``felt`` times itself.

    A deflected tyre has a smaller rolling radius, and the driveline's inertia resists the change of wheel speed that
    this asks for. The longitudinal force acts at the height of the axle, below the centre of gravity: it pitches the
    body nose down by a moment of c v times the rate of the tyres' compression, v being the speed.
    """

    def __init__(self, numbers: F64, ground: Ground, at: Frequencies, n_sensors: int, speed_mps: float) -> None:
        self._numbers = n = np.asarray(numbers, complex)[..., None]
        self._fixed = fixed = n[:, :, :1]
        self._by_moment: C128
        self._by_force: C128
        self._ground, self._at, self._n_sensors, self._speed_mps = ground, at, n_sensors, speed_mps
        self.rolls = len(n) > car.N_UPRIGHT
        spring, damper = n[car.SPRING][None], n[car.DAMPER][None]
        if self.rolls:
            spring = np.concatenate([spring, spring + fixed[car.BAR]])
            damper = np.concatenate([damper, damper * fixed[car.FACTOR]])
        self._tyre: C128 = fixed[car.TYRE]
        self._wheel: C128 = self._tyre - at.omega2 * fixed[car.UNSPRUNG]
        damped, mount = at.turn * damper, fixed[car.MOUNT]
        self._yields = mount / (mount + damped)
        self._rates = damped * self._yields
        self._rates += spring
        self._softs = 1.0 / (self._rates + self._wheel)
        self.per_tyre = self._rates * self._softs
        """(1 or 3, 2, k, 5, m)."""
        if self.rolls:
            self._even = 0.5 * self._softs[0] * self._softs[1] * self._wheel
            self.per_tyre = np.concatenate([self.per_tyre, (n[car.UNEVEN] * self._even)[None]])
        self._force = self.per_tyre * self._tyre
        self._ratio = at.hz / fixed[car.MODE]
        self._damping: C128 = (2j * fixed[car.DAMPING]) * self._ratio
        self._below = 1.0 / ((1.0 - self._ratio**2) + self._damping)
        self._felt = (1.0 + self._damping) * self._below
        self._late: C128 = at.turn * np.exp(-at.turn * fixed[car.LAG])
        self._stiff = self._solved()
        self._by_force_stiff = self._sensed(self._stiff)
        self._couple()
        self.paths = self._with_driveline(self._forced(self._by_force_stiff), self._by_force_stiff)
        """(p, s, k, 5, m) sensor readings per unit of road."""

    def _solved(self) -> C128:
        """(c, c, k, 5, m) the inverse of the stiffness without the driveline; roll is eliminated first."""
        stiffness = self.per_tyre * self._wheel
        fixed, omega2 = self._fixed, self._at.omega2
        inertia = omega2 * (fixed[car.RIGID] + self._felt * fixed[car.CARRIED])
        straight = stiffness[0] - inertia[:2]
        if not self.rolls:
            return _inverse(straight[0], straight[1], -inertia[2])
        inertia_roll = omega2 * (fixed[car.RIGID_ROLL] + self._felt * fixed[car.CARRIED_ROLL])
        d_pp = stiffness[1, 0] + stiffness[1, 1] - inertia_roll[2]
        coupled = stiffness[2] - inertia_roll[:2]
        by_f, by_r = by = coupled / d_pp
        straight -= by * coupled
        upper = _inverse(straight[0], straight[1], -inertia[2] - by_f * coupled[1])
        found = np.empty((3, 3, *upper.shape[2:]), complex)
        found[:2, :2] = upper
        found[2, :2] = found[:2, 2] = -(by_f * upper[0] + by_r * upper[1])
        found[2, 2] = 1.0 / d_pp - by_f * found[2, 0] - by_r * found[2, 1]
        return found

    def _sensed(self, body: C128) -> C128:
        """(p, ...) sensor readings of a body that moves by ``body`` (c, ...).

        Of a sensor ``left_m`` left of the centre line, its gyro turned to the left by ``yaw_rad``.
        """
        fixed, ground = self._fixed, self._ground
        sensed = np.empty((self._n_sensors, *body.shape[1:]), complex)
        turned = body[1] - body[0]
        heave = body[0] + (fixed[car.POSITION] / ground.wheelbase_m) * turned
        pitch = np.multiply(self._late / ground.wheelbase_m, turned, out=sensed[1])
        if self.rolls:
            heave += (fixed[car.LEFT] / ground.half_track_m) * body[2]
            yaw, roll = fixed[car.YAW], (self._late / ground.half_track_m) * body[2]
            if self._n_sensors > 2:
                sensed[2] = roll + yaw * pitch
            pitch -= yaw * roll
        np.multiply(-self._at.omega2 * fixed[car.GAIN], heave, out=sensed[0])
        return sensed

    def _forced(self, by_force: C128) -> C128:
        """(r, s, k, 5, m) from r responses (r, c, k, 5, m) to forces of the road."""
        forced: C128 = by_force[:, :2] * self._force[0]
        if not self.rolls:
            return forced
        roll = by_force[:, 2, None]
        against = by_force[:, :2] * self._force[2] + roll * self._force[1]
        return np.concatenate([forced + roll * self._force[2], against], axis=1)

    def _couple(self) -> None:
        """The moment of the driveline by the road, with the body's answer to it.

        It adds a matrix of rank one to the stiffness (J. Sherman and W. J. Morrison, Ann. Math. Stat. 21, 1950).
        """
        self._lever = self._at.turn * (self._speed_mps / self._ground.wheelbase_m)
        self._moment = moment = self._fixed[car.DRIVELINE] * self._lever
        """(2, k, 1, m) lift of the rear, and fall of the front, by the compression of the tyres of either axle."""
        pressed = moment * (1.0 - self._tyre * self._softs[0])
        front, rear = (moment * self.per_tyre[0])[:, None] * self._stiff[:2]
        by_body = front + rear
        if self.rolls:
            pressed = np.concatenate([pressed, moment * self._free * self.per_tyre[2]])
            by_body += (moment * self.per_tyre[2]).sum(axis=0) * self._stiff[2]
        self._answer = 1.0 / (1.0 + (by_body[1] - by_body[0]))
        self._by_body = by_body * self._answer
        self._lift = (pressed - self._forced(by_body[None])[0]) * self._answer

    def _with_driveline(self, forced: C128, by_force: C128) -> C128:
        """(r, s, k, 5, m) with the driveline."""
        return np.asarray(forced + (by_force[:, 1] - by_force[:, 0])[:, None] * self._lift)

    def by_speed(self) -> C128:
        """(p, s, k, 5, m) derivative of the paths by the speed, through the driveline."""
        by_moment = self._by_force_stiff[:, 1] - self._by_force_stiff[:, 0]
        return np.asarray((by_moment * (self._answer / self._speed_mps))[:, None] * self._lift)

    @cached_property
    def body(self) -> C128:
        """(c, s, k, 5, m) displacement of the body at each coordinate per unit of road."""
        return self._with_driveline(self._forced(self._stiff), self._stiff)

    @cached_property
    def _free(self) -> C128:
        """(2, k, 1, m) t/T, how far the road moves a wheel without suspension."""
        return np.asarray(self._tyre / self._wheel)

    def strokes(self) -> C128:
        """(2, 2, k, 5, m) stretch of the springs of both axles (first), by the road under either (second).

        With K the suspension and T the wheel on its tyre the wheel moves by (K body + t road) / (K + T).
        """
        road = self._tyre[:, None] * np.eye(2)[:, :, None, None, None]
        return np.asarray(self._softs[0, :, None] * (self._wheel[:, None] * self.body[:2, :2] - road))

    def slopes(self, wanted: I64) -> C128:
        """(len(wanted), p, s, k, 5, m) derivatives of the paths by these of the numbers, in rising order.

        Each is a sum of products of what a force does to the sensors (p) and what a way of the road moves (s).
        """
        found = complex_buffer("slopes", (len(self._numbers), *self.paths.shape))
        stiff = self._by_force_stiff
        self._by_moment = (stiff[:, 1] - stiff[:, 0]) * self._answer
        self._by_force = stiff - (stiff[:, 1] - stiff[:, 0])[:, None] * self._by_body
        is_wanted = np.zeros(car.N_ROLLING, bool)
        is_wanted[wanted] = True
        if is_wanted[_OF_MASSES].any():
            self._fill_in_by_masses(found)
        if is_wanted[_OF_AXLES].any():
            self._fill_in_by_axles(found, is_wanted)
        if is_wanted[_OF_SENSORS].any():
            self._fill_in_by_sensor(found)
        return found[: len(wanted)] if is_wanted[: len(wanted)].all() else found[wanted]

    def _fill_in_by_masses(self, found: C128) -> None:
        """Fill in the derivatives by the masses, and by frequency and damping ratio of the payload on its floor."""
        fixed, a, u = self._fixed, self._by_force * self._at.omega2, self.body
        pulled = a[:, :, None, None] * u[:, None].swapaxes(0, 1)  # (p, c, c, s, k, 5, m)
        carried = np.zeros_like(self.paths)
        for rigid, load, pairs in _MASSES[: 1 + self.rolls]:
            for into, (i, j) in zip(found[rigid], pairs, strict=True):
                if i == j:
                    into[...] = pulled[:, i, i]
                else:
                    np.add(pulled[:, i, j], pulled[:, j, i], out=into)
            np.multiply(found[rigid], self._felt, out=found[load])
            for kg, one in zip(fixed[load], found[rigid], strict=True):
                carried += kg * one
        by_felt = -((self._ratio * self._below) ** 2)
        np.multiply(carried, by_felt * (2.0 + self._damping) / fixed[car.MODE], out=found[car.MODE])
        np.multiply(carried, by_felt * (2j * self._ratio), out=found[car.DAMPING])

    def _fill_in_by_sensor(self, found: C128) -> None:
        """Fill in those by the sensor's position, the gyro's lag, the accelerometer's gain and, with roll, the sensor's
        place to the left and its yaw.
        """
        fixed, ground = self._fixed, self._ground
        heave = -self._at.omega2 * fixed[car.GAIN]
        turned = self.body[1] - self.body[0]
        found[car.POSITION : car.LAG + 1] = 0.0
        np.multiply(heave / ground.wheelbase_m, turned, out=found[car.POSITION, 0])
        np.multiply(-self._at.turn, self.paths[1:], out=found[car.LAG, 1:])
        found[car.GAIN] = 0.0
        np.divide(self.paths[0], fixed[car.GAIN], out=found[car.GAIN, 0])
        if self.rolls:
            roll = self.body[2] / ground.half_track_m
            found[car.LEFT :] = 0.0
            np.multiply(heave, roll, out=found[car.LEFT, 0])
            np.multiply(-self._late, roll, out=found[car.YAW, 1])
            found[car.YAW, 2:] = (self._late / ground.wheelbase_m) * turned

    def _fill_in_by_axles(self, found: C128, is_wanted: Bool) -> None:
        """Fill in those by the drivelines and by the numbers of both axles, which change the ratios q, q', q'' =
        ``per_tyre``.

        With h = t/T road - body, together and against, a ratio's change moves the sensors by dq g h + dq' g' h' + dq''
        (g h' + g' h), where g is what forces T on the body and the moment do to the sensors. What t and T change beside
        the ratios goes by h and by the road alone.
        """
        n, fixed, a, omega2 = self._numbers, self._fixed, self._by_force.swapaxes(0, 1), self._at.omega2
        ratios, moment = self.per_tyre, _wide(self._moment)
        h = np.empty((1 + self.rolls, 2, *self.paths.shape[1:]), complex)
        np.negative(self.body[:2], out=h[0])
        g = [_wide(self._wheel) * a[:2] + moment * self._by_moment]
        held = [_wide(ratios[0]) * a[:2]]
        if self.rolls:
            h[1] = -self.body[2]
            g.append(_wide(self._wheel) * a[2])
            held[0] += _wide(ratios[2]) * a[2]
            held.append(_wide(ratios[1]) * a[2] + _wide(ratios[2]) * a[:2])
        for way, one in enumerate(h):
            _own(one[:, None], way)[:, 0] += self._free
        if self.rolls:
            _fill_in(found[car.UNEVEN], [_wide(self._even) * one for one in g[::-1]], h)
            if not is_wanted[: car.DRIVELINE.stop].any() and not is_wanted[car.FACTOR.start : car.BAR.stop].any():
                return
        rates, wheels = self._by_ratios(g)
        by_damper, by_mount = self._at.turn * self._yields**2, (1.0 - self._yields) ** 2
        if self.rolls:
            if is_wanted[car.FACTOR.start : car.BAR.stop].any():
                _fill_in(found[car.BAR], rates[1], h)
                _fill_in(found[car.FACTOR], [_wide(by_damper[1] * n[car.DAMPER]) * one for one in rates[1]], h)
            by_damper[1] *= fixed[car.FACTOR]
        axles = np.empty((len(h), 5, *g[0].shape), complex)  # springs, dampers, mounts, tyres and unsprung masses
        for into, one, wheel, still in zip(axles, rates[0], wheels, held, strict=True):
            into[0] = one
            np.multiply(_wide(by_damper[0]), one, out=into[1])
            np.multiply(_wide(by_mount[0]), one, out=into[2])
            np.add(wheel, still, out=into[3])
            np.multiply(-omega2, into[3], out=into[4])
        if self.rolls:
            for into, one in zip(axles, rates[1], strict=True):
                into[0] += one
                into[1] += _wide(by_damper[1]) * one
                into[2] += _wide(by_mount[1]) * one
        _fill_in(found[: car.UNSPRUNG.stop].reshape(5, 2, *self.paths.shape), axles, h)
        driven = self._lever * self._by_moment
        _fill_in(found[car.DRIVELINE], _wide(ratios[::2]) * driven, h)
        by_moment = (moment / _wide(self._wheel)) * self._by_moment
        held[0] += _wide(ratios[0] - 1.0) * by_moment
        if self.rolls:
            held[1] += _wide(ratios[2]) * by_moment
        bound = _wide(1.0 - self._free)
        _own(found[car.DRIVELINE], 0)[...] += bound * driven
        for way, one in enumerate(held):
            _own(found[car.TYRE], way)[...] += bound * one
            _own(found[car.UNSPRUNG], way)[...] += _wide(omega2 * self._free) * one

    def _by_ratios(self, g: list[C128]) -> tuple[list[list[C128]], list[C128]]:
        """What the rate of the suspension together, and against, multiplies h and h' by; and what T does through the
        ratios. Each is (2, p, k, 5, m).
        """
        squared = self._softs**2
        by_rate, by_wheel = self._wheel * squared, -self._rates * squared
        if not self.rolls:
            return [[_wide(by_rate[0]) * g[0]]], [_wide(by_wheel[0]) * g[0]]
        one, other = self._softs
        even = _wide(self._numbers[car.UNEVEN] * (0.5 * one * other - self._even * (one + other)))
        coupled = _wide(-self.per_tyre[2] * self._softs)
        together = [_wide(by_rate[0]) * g[0] + coupled[0] * g[1], coupled[0] * g[0]]
        against = [coupled[1] * g[1], _wide(by_rate[1]) * g[1] + coupled[1] * g[0]]
        return [together, against], [_wide(by_wheel[i]) * g[i] + even * g[1 - i] for i in range(2)]


def _fill_in(found: C128, sensed: list[C128] | C128, moved: C128) -> None:
    """The sum of products (..., 2, p, s, k, 5, m) of ``sensed`` (..., 2, p, k, 5, m) and ``moved`` (2, s, k, 5, m)."""
    for i, (one, other) in enumerate(zip(sensed, moved, strict=True)):
        if i:
            found += one[..., None, :, :, :] * other[:, None]
        else:
            np.multiply(one[..., None, :, :, :], other[:, None], out=found)


def _own(of_axles: C128, way: int) -> C128:
    """(2, p, k, 5, m) view of (2, p, s, k, 5, m): each axle by the road under itself, together (0) or against (1)."""
    view: C128 = np.einsum("ipi...->ip...", of_axles[:, :, 2 * way : 2 * way + 2])
    return view


def _wide(of_axles: C128) -> C128:
    """(..., 2, 1, k, 5, m) of (..., 2, k, 5, m), to multiply what is by sensor."""
    return of_axles[..., None, :, :, :]


def _inverse(ff: C128, rr: C128, fr: C128) -> C128:
    """The inverses of symmetric matrices of two rows."""
    per_determinant = 1.0 / (ff * rr - fr**2)
    found = np.empty((2, 2, *per_determinant.shape), complex)
    np.multiply(rr, per_determinant, out=found[0, 0])
    np.multiply(ff, per_determinant, out=found[1, 1])
    found[0, 1] = found[1, 0] = -fr * per_determinant
    return found
