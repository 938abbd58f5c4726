"""How spectra are taken of a vehicle, so that calibration and weighing take them alike."""

from dataclasses import dataclass, replace

from gateway.core.cross_spectrum.model.mount import Mount


@dataclass(frozen=True, slots=True)
class Reading:
    """How spectra are taken of a vehicle: band_hz is inclusive, n_segment in samples.

    usual_log_amplitude is how much the vehicle moved in calibration (measured.log_amplitude_of); None for as much as in
    the drive that is read. usual_stroke_mps is how fast the springs of front and rear axle moved there (model.strokes);
    None where friction goes by how much the body moves. with_roll: the roll rate is read too, where a drive has enough
    of it; then all is read as on the centre line, if mount says where the sensor sits.
    """

    wheelbase_m: float
    band_hz: tuple[float, float]
    n_segment: int
    usual_log_amplitude: float | None = None
    with_roll: bool = False
    mount: Mount | None = None
    usual_stroke_mps: tuple[float, float] | None = None

    def with_gyro_late_by(self, lag_s: float) -> "Reading":
        """The same with another lag of the gyro, where a mount is told."""
        return replace(self, mount=replace(self.mount, gyro_lag_s=lag_s)) if self.mount else self
