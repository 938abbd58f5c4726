"""A car on four wheels of their own, put together by numpy alone from the parameters: what the model is held to.

The payload is firm on its floor, and springs have a slope but no bends. Coordinates: the body over its axles, its left
side's height over the wheels' mean, and four wheels.
"""

import numpy as np

from gateway.model.car import Ground, natural
from gateway.model.table import NAMES
from gateway.records import C128, F64
from gateway.units import STANDARD_GRAVITY_MPS2

WHEELS = ((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0))  # axle, side: left is positive


class FourWheels:
    """The vehicle theta (n,) with roll under a payload, ``position_m`` behind the front axle and ``left_m`` left."""

    def __init__(self, theta: F64, ground: Ground, payload_kg: float, position_m: float, left_m: float) -> None:
        self.of = dict(zip(NAMES, natural(theta).tolist(), strict=True))
        self.ground, self.payload_kg, self.position_m, self.left_m = ground, payload_kg, position_m, left_m
        empty_kg = ground.empty_mass_kg
        self.all_kg = empty_kg + payload_kg
        self.added_kg = payload_kg * np.array([1.0 - position_m / ground.wheelbase_m, position_m / ground.wheelbase_m])
        front_share = (ground.empty_front_share * empty_kg + self.added_kg[0]) / self.all_kg
        cg_left_m = (empty_kg * self.of["empty_left_m"] + payload_kg * left_m) / self.all_kg
        self.load = (payload_kg, float(front_share), float(cg_left_m))
        """As the model takes it."""

    def axle(self, kind: str, unit: str = "") -> F64:
        """(2,) a parameter of both axles."""
        return np.array([self.of[f"{kind}_{end}{unit}"] for end in ("front", "rear")])

    @property
    def level_springs_npm(self) -> F64:
        """(4,) each wheel's spring under half its axle's load."""
        added_kn = self.added_kg * STANDARD_GRAVITY_MPS2 / 1000.0
        return np.repeat(0.5 * self.axle("spring", "_npm") * np.exp(self.axle("spring_slope", "_per_kn") * added_kn), 2)

    @property
    def springs_npm(self) -> F64:
        """(4,) each as under an axle with twice its own load."""
        more_kn = np.outer(self.more_on_the_left_n, [1.0, -1.0]).ravel() / 1000.0
        return self.level_springs_npm * np.exp(2.0 * np.repeat(self.axle("spring_slope", "_per_kn"), 2) * more_kn)

    @property
    def more_on_the_left_n(self) -> F64:
        """(2,) what the left wheel of either axle carries more than half, by statics."""
        moment_nm = STANDARD_GRAVITY_MPS2 * self.all_kg * self.load[2]
        rest = np.linalg.solve(self.stiffness(self.level_springs_npm, 0.0).real, -moment_nm * np.eye(7)[2])
        tyres = -0.5 * np.repeat(self.axle("tyre", "_npm"), 2) * rest[3:]
        return np.asarray(0.5 * (tyres[::2] - tyres[1::2]))

    def damper_npm(self, omega: float, factor: F64 | float = 1.0) -> C128:
        """(2,) on their mounts."""
        damper = 1j * omega * self.axle("damper", "_nspm") * factor
        mount = self.axle("damper_mount", "_npm")
        return np.asarray(damper * mount / (damper + mount))

    def stiffness(self, springs_npm: F64, omega: float) -> C128:
        """(7, 7)."""
        found = np.zeros((7, 7), complex)
        struts = np.zeros((4, 7))
        for wheel, (axle, side) in enumerate(WHEELS):
            struts[wheel, [axle, 2, 3 + wheel]] = 1.0, side * self.ground.half_track_m, -1.0
            rate = springs_npm[wheel] + 0.5 * self.damper_npm(omega)[axle]
            found += rate * np.outer(struts[wheel], struts[wheel])
            found[3 + wheel, 3 + wheel] += 0.5 * self.axle("tyre", "_npm")[axle]
        more = self.damper_npm(omega, self.axle("damper_against")) - self.damper_npm(omega)
        for axle, rate in enumerate(self.axle("anti_roll", "_npm") + more):
            opposed = 0.5 * (struts[2 * axle] - struts[2 * axle + 1])
            found += rate * np.outer(opposed, opposed)
        return found

    @property
    def mass(self) -> F64:
        """(7, 7), from the places of body and payload; the empty body's inertia is about the roll axis."""
        length_m, empty_kg, left_m = self.ground.wheelbase_m, self.ground.empty_mass_kg, self.of["empty_left_m"]

        def place(behind_m: float, to_left_m: float) -> F64:
            share = behind_m / length_m
            return np.array([1.0 - share, share, to_left_m, 0.0, 0.0, 0.0, 0.0])

        pitch, roll = np.array([-1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]) / length_m, np.eye(7)[2]
        empty, payload = (
            place((1.0 - self.ground.empty_front_share) * length_m, left_m),
            place(self.position_m, self.left_m),
        )
        found = empty_kg * np.outer(empty, empty) + self.payload_kg * np.outer(payload, payload)
        in_pitch = self.of["pitch_inertia_kgm2"] + self.payload_kg * self.of["payload_gyration_m2"]
        in_roll = self.of["roll_inertia_kgm2"] - empty_kg * left_m**2
        in_roll += self.payload_kg * self.of["payload_roll_gyration_m2"]
        found += in_pitch * np.outer(pitch, pitch) + in_roll * np.outer(roll, roll)
        found[range(3, 7), range(3, 7)] = 0.5 * np.repeat(self.axle("unsprung", "_kg"), 2)
        return np.asarray(found)

    def moved(self, freq_hz: F64, speed_mps: float) -> C128:
        """(7, 4, m) movement by both tracks alike under front and rear, then one against the other."""
        springs_npm, mass, roads = self.springs_npm, self.mass, np.zeros((7, 4), complex)
        found = np.empty((7, 4, len(freq_hz)), complex)
        for wheel, (axle, side) in enumerate(WHEELS):
            roads[3 + wheel, [axle, 2 + axle]] = 0.5 * self.axle("tyre", "_npm")[axle] * np.array([1.0, side])
        for i, omega in enumerate(2.0 * np.pi * freq_hz):
            whole, force = self.stiffness(springs_npm, omega) - omega**2 * mass, roads.copy()
            lift = 1j * omega * speed_mps * self.axle("driveline", "_kg") / self.ground.wheelbase_m
            for axle in range(2):  # of the rear, and fall of the front, by road less mean of both wheels
                for row, sign in ((0, -1.0), (1, 1.0)):
                    force[row, axle] += sign * lift[axle]
                    whole[row, 3 + 2 * axle : 5 + 2 * axle] += 0.5 * sign * lift[axle]
            found[:, :, i] = np.linalg.solve(whole, force)
        return found

    def paths(self, freq_hz: F64, speed_mps: float = 14.0) -> C128:
        """(3, 4, m) readings of acceleration, pitch rate and roll rate, the gyro square and prompt."""
        moved, omega = self.moved(freq_hz, speed_mps), 2.0 * np.pi * freq_hz
        pitch = (moved[1] - moved[0]) / self.ground.wheelbase_m
        at_sensor = moved[0] + self.of["sensor_position_m"] * pitch + self.of["sensor_left_m"] * moved[2]
        return np.array([-(omega**2) * self.of_gain * at_sensor, 1j * omega * pitch, 1j * omega * moved[2]])

    @property
    def of_gain(self) -> float:
        """The accelerometer's gain."""
        return float(np.exp(self.of["accelerometer_gain"]))

    def strokes(self, freq_hz: F64, speed_mps: float = 14.0) -> C128:
        """(2, 4, m) stretch of the springs of both axles, the mean of left and right."""
        moved = self.moved(freq_hz, speed_mps)
        return np.array([moved[axle] - moved[3 + 2 * axle : 5 + 2 * axle].mean(axis=0) for axle in range(2)])
