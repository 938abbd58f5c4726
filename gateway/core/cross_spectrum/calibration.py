"""What the cross-spectral estimator knows of a vehicle: the half-car that its known-load drives taught."""

from dataclasses import dataclass
from typing import Final

from gateway.core.cross_spectrum.measured import Reading
from gateway.core.cross_spectrum.model.parameters import Ground
from gateway.core.vehicle import Load
from gateway.records import F64

SCORE: Final = 6.0  # six standard deviations are no chance; a calibration that shows more of its own allows more


@dataclass(frozen=True, slots=True)
class CrossSpectrumCalibration:
    """What known-load drives taught, as plain numbers and arrays.

    parameters (p,) and covariance (p, p) follow ``names`` (parameters.PARAMETERS; logarithms where
    these are positive quantities). The inflations widen standard deviations, by so much more per_reach
    as a load lies beyond ``known_loads`` (reach.beyond); misfit_limit is the
    largest likelihood ratio per degree of freedom that is still believed; the two amplitudes are
    root mean squares within the band. usual_log_amplitude: see measured.Reading. gravity_mps2 is what the
    accelerometer read on average; None where the file does not say. The two scores are the largest that are believed
    of a sensor that nobody touched (sensor_change).
    """

    empty_mass_kg: float
    empty_front_share_pct: float
    wheelbase_m: float
    band_hz: tuple[float, float]
    n_segment: int
    names: tuple[str, ...]
    parameters: F64
    covariance: F64
    payload_inflation: float
    front_share_inflation: float
    misfit_limit: float
    acceleration_rms_mps2: float
    pitch_rate_rms_radps: float
    payload_seen_kg: tuple[float, float]
    front_share_seen_pct: tuple[float, float]
    speed_seen_mps: tuple[float, float]
    warnings: tuple[str, ...] = ()
    known_loads: tuple[Load, ...] = ()
    payload_inflation_per_reach: float = 0.0
    front_share_inflation_per_reach: float = 0.0
    usual_log_amplitude: float | None = None
    gravity_mps2: float | None = None
    most_position_score: float = SCORE
    most_noise_score: float = SCORE

    @property
    def ground(self) -> Ground:
        """The vehicle as stated, in the core's terms."""
        return Ground(self.empty_mass_kg, self.empty_front_share_pct / 100.0, self.wheelbase_m)

    @property
    def reading(self) -> Reading:
        """How spectra of this vehicle are taken."""
        return Reading(self.wheelbase_m, self.band_hz, self.n_segment, self.usual_log_amplitude)
