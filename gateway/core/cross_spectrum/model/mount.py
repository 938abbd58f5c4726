"""Where the sensor sits, and what it would have read on the centre line, square to it.

A sensor y metres left of the centre line reads y times the roll acceleration beside the heave, and a gyro that is
turned takes a little of the roll rate for pitch rate. Both are linear in what the three signals read, so that they are
taken out of each transform, frequency by frequency. Roll that is seen for what it is moves no load.

That follows from a rigid body's rotation (axes and signs of ISO 8855), to first order in the turn. The map of the three
transforms has the determinant 1 + yaw^2, which neither frequency nor lever arm changes: the likelihood of all three is
the same whether the spectra are brought to the centre line or the model's sensor is put off it.
"""

from dataclasses import dataclass

import numpy as np

from gateway.records import C128, F64


@dataclass(frozen=True, slots=True)
class Mount:
    """A sensor left_m left of the centre line, its gyro turned about the vertical, to the left, by yaw_rad, and behind
    the accelerometer by gyro_lag_s.
    """

    left_m: float
    yaw_rad: float
    gyro_lag_s: float

    def levelled(self, sensed: tuple[C128, C128, C128], freq_hz: F64) -> tuple[C128, C128, C128]:
        """Transforms (k, m) of acceleration, pitch rate and roll rate, at freq_hz (m,), as on the centre line.

        The acceleration less left_m times the derivative of the roll rate, with which the gyro was not late. The rates
        come back square to the vehicle, but as late as they were: the half-car has that lag as a parameter.
        """
        acceleration, pitch_rate, roll_rate = sensed
        turn = 2j * np.pi * freq_hz
        roll_rate, pitch_rate = roll_rate - self.yaw_rad * pitch_rate, pitch_rate + self.yaw_rad * roll_rate
        return acceleration - self.left_m * turn * np.exp(turn * self.gyro_lag_s) * roll_rate, pitch_rate, roll_rate
