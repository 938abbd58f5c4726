"""How spectra of a vehicle are computed, the same for calibration and for estimates, and the place of its sensor.

A sensor y metres left of the centre line reads y times the roll acceleration in addition to heave, and a gyro turned
about the vertical mixes some roll rate into the pitch rate. Both are linear in the three signals, so that they are
removed from each transform, frequency by frequency. Roll that is recognised as such does not change the load.
This follows from a rigid body's rotation (axes and signs of ISO 8855), to first order in the turn. The map of the three
transforms has the determinant 1 + yaw^2, independent of frequency and lever arm: the likelihood of all three is the
same whether the spectra are moved to the centre line or the model's sensor is moved off it.
"""

from dataclasses import dataclass, replace

import numpy as np

from gateway.records import C128, F64


@dataclass(frozen=True, slots=True)
class Mount:
    """A sensor left_m left of the centre line, its gyro turned to the left about the vertical by yaw_rad, and delayed
    against the accelerometer by gyro_lag_s.
    """

    left_m: float
    yaw_rad: float
    gyro_lag_s: float

    def levelled(self, sensed: tuple[C128, C128, C128], freq_hz: F64) -> tuple[C128, C128, C128]:
        """Transforms (k, m) of acceleration, pitch rate and roll rate, at freq_hz (m,), as on the centre line.

        The acceleration minus left_m times the derivative of the roll rate without the gyro's lag. The rates are square
        to the vehicle but keep their lag: the half-car has it as a parameter.
        """
        acceleration, pitch_rate, roll_rate = sensed
        turn = 2j * np.pi * freq_hz
        roll_rate, pitch_rate = roll_rate - self.yaw_rad * pitch_rate, pitch_rate + self.yaw_rad * roll_rate
        return acceleration - self.left_m * turn * np.exp(turn * self.gyro_lag_s) * roll_rate, pitch_rate, roll_rate


@dataclass(frozen=True, slots=True)
class Reading:
    """How spectra of a vehicle are computed: band_hz is inclusive, n_segment in samples.

    usual_log_amplitude is the vehicle's amplitude in calibration (measured.log_amplitude_of); None: that of the drive
    itself. usual_stroke_mps is the stroke speed of front and rear springs there (model.strokes); None if friction
    follows the body's amplitude. with_roll: the roll rate is used too, if a drive has enough of it; then all signals
    are moved to the centre line, if mount has the sensor's place.
    """

    wheelbase_m: float
    band_hz: tuple[float, float]
    n_segment: int
    usual_log_amplitude: float | None = None
    with_roll: bool = False
    mount: Mount | None = None
    usual_stroke_mps: tuple[float, float] | None = None

    def with_gyro_late_by(self, lag_s: float) -> "Reading":
        """The same with another lag of the gyro, if it has a mount."""
        return replace(self, mount=replace(self.mount, gyro_lag_s=lag_s)) if self.mount else self
