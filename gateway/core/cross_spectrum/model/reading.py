"""How spectra of a vehicle are computed, the same for calibration and for estimates."""

from dataclasses import dataclass, replace

from gateway.core.cross_spectrum.model.mount import Mount


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
