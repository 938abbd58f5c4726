"""Where the sensor sits, and what it would have read on the centre line, square to it.

A sensor y metres left of the centre line reads y times the roll acceleration beside the heave, and a gyro that is
turned takes a little of the roll rate for pitch rate. Both are linear in what the three signals read, so that they are
taken out of each transform, frequency by frequency. Roll that is seen for what it is moves no load.
"""

from dataclasses import dataclass

import numpy as np

from gateway.records import C128, F64


@dataclass(frozen=True, slots=True)
class Mount:
    """A sensor left_m left of the centre line, its gyro turned to the left by yaw_rad and late by gyro_lag_s."""

    left_m: float
    yaw_rad: float
    gyro_lag_s: float

    def levelled(self, sensed: tuple[C128, C128, C128], freq_hz: F64) -> tuple[C128, C128, C128]:
        """Transforms (k, m) of acceleration, pitch rate and roll rate as on the centre line: a - y dp/dt, p the roll
        rate before the gyro was turned and late.
        """
        acceleration, pitch_rate, roll_rate = sensed
        turn = 2j * np.pi * freq_hz
        roll_rate, pitch_rate = roll_rate - self.yaw_rad * pitch_rate, pitch_rate + self.yaw_rad * roll_rate
        return acceleration - self.left_m * turn * np.exp(turn * self.gyro_lag_s) * roll_rate, pitch_rate, roll_rate
