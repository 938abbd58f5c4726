"""The calibration of the cross-spectral estimator: the half-car fitted to drives with known loads."""

from dataclasses import dataclass, field, replace
from typing import Annotated, Final

import numpy as np
from annotated_types import Ge, Gt

from gateway.core.cross_spectrum.model.parameters import INDEX, LEAST_SLACK, PARAMETERS, Ground, mount_of
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.vehicle import UNKNOWN_OFFSET_STD_M, Load
from gateway.core.weights.on_the_road import Unsprung
from gateway.estimate import Quantity
from gateway.records import F64
from gateway.schema import STRICT

SCORE: Final = (
    6.0  # chosen: standard deviations, beyond chance; a calibration with larger scores of its own allows more
)

Positive = Annotated[float, Gt(0.0)]
NonNegative = Annotated[float, Ge(0.0)]
_POSITIVE: Final = {"gt": 0.0}


@dataclass(frozen=True, slots=True)
class CrossSpectrumCalibration:
    """The fitted half-car and its uncertainty, as plain numbers and arrays.

    parameters (n,) and covariance (n, n) follow ``names`` (parameters.PARAMETERS, then ROLL_PARAMETERS if a roll rate
    was used); positive quantities are logarithms. directions (n, k) is the part of a root of the covariance that moves
    loads: independent causes of unit variance. model_std is the model's own error in payload (kg), front share (%) and
    lateral place (m), from runs left out of the fit; the first two grow by model_per_reach as a load is beyond
    ``known_loads`` (reach.beyond). misfit_limit is the largest accepted likelihood ratio per degree of freedom; the two
    amplitudes are root mean squares within the band. usual_log_amplitude: see model.reading. gravity_mps2 is the mean
    reading of the accelerometer; None if the file does not have it. The two scores are the largest accepted of an
    untouched sensor (sensor_change). sensor_left_m is the stated place left of the centre line. least_slack: see
    parameters.Ground. usual_stroke_mps: see model.reading; None also if no roll rate was used. floor has each sensor's
    noise level in the quietest and in the loudest batch, above the analysed band (cross_spectrum.floor), in the square
    of its unit per hertz; None: unknown. gyro_gain is the gyro's gain relative to the accelerometer's, measured in
    bends, and its standard deviation; None if no drive gave one.
    """

    __pydantic_config__ = STRICT

    empty_mass_kg: float = field(metadata=_POSITIVE)
    empty_front_share_pct: float
    wheelbase_m: float = field(metadata=_POSITIVE)
    band_hz: tuple[float, float]
    n_segment: int = field(metadata={"ge": 64, "le": 65_536})
    names: tuple[str, ...]
    parameters: F64
    covariance: F64
    directions: F64
    model_std: tuple[NonNegative, NonNegative, NonNegative]
    misfit_limit: float = field(metadata=_POSITIVE)
    acceleration_rms_mps2: float = field(metadata=_POSITIVE)
    pitch_rate_rms_radps: float = field(metadata=_POSITIVE)
    payload_seen_kg: tuple[float, float]
    front_share_seen_pct: tuple[float, float]
    speed_seen_mps: tuple[float, float]
    warnings: tuple[str, ...] = ()
    known_loads: tuple[Load, ...] = ()
    model_per_reach: tuple[NonNegative, NonNegative] = (0.0, 0.0)
    usual_log_amplitude: float | None = None
    gravity_mps2: float | None = field(default=None, metadata=_POSITIVE)
    most_position_score: float = field(default=SCORE, metadata=_POSITIVE)
    most_noise_score: float = field(default=SCORE, metadata=_POSITIVE)
    track_width_m: float | None = field(default=None, metadata=_POSITIVE)
    sensor_left_m: float = 0.0
    sensor_left_std_m: float = field(default=UNKNOWN_OFFSET_STD_M, metadata=_POSITIVE)
    least_slack: float = field(default=LEAST_SLACK, metadata=_POSITIVE)
    usual_stroke_mps: tuple[Positive, Positive] | None = None
    floor: tuple[tuple[Positive, Positive], ...] | None = None
    gyro_gain: tuple[Positive, Positive] | None = None

    @property
    def ground(self) -> Ground:
        """The vehicle as stated, in the model's terms."""
        share = self.empty_front_share_pct / 100.0
        return Ground(self.empty_mass_kg, share, self.wheelbase_m, self.track_width_m, self.least_slack)

    @property
    def upright(self) -> "CrossSpectrumCalibration":
        """The calibration without the roll parameters."""
        n = len(PARAMETERS)
        return replace(
            self,
            names=self.names[:n],
            parameters=self.parameters[:n],
            covariance=self.covariance[:n, :n],
            directions=self.directions[:n],
        )

    @property
    def known_shape(self) -> tuple[float, float]:
        """Squared radius of gyration of the known loads in pitch (m2), and the standard deviation of its logarithm."""
        entry = INDEX["payload_gyration_m2"]
        return float(np.exp(self.parameters[entry])), float(np.sqrt(self.covariance[entry, entry]))

    @property
    def unsprung(self) -> Unsprung:
        """Unsprung masses with errors, to first order in their fitted logarithms."""
        entries = [INDEX["unsprung_front_kg"], INDEX["unsprung_rear_kg"]]
        front_kg, rear_kg = (float(kg) for kg in np.exp(self.parameters[entries]))
        covariance = self.covariance[np.ix_(entries, entries)]
        front_std, rear_std = (float(std) for std in np.sqrt(np.diag(covariance)))
        return Unsprung(
            Quantity(front_kg, front_kg * front_std),
            Quantity(rear_kg, rear_kg * rear_std),
            float(covariance[0, 1]) / (front_std * rear_std) if front_std * rear_std else 0.0,
        )

    @property
    def reading(self) -> Reading:
        """How spectra of this vehicle are computed."""
        mount = mount_of(self.parameters)
        return Reading(
            self.wheelbase_m,
            self.band_hz,
            self.n_segment,
            self.usual_log_amplitude,
            with_roll=mount is not None,
            mount=mount,
            usual_stroke_mps=self.usual_stroke_mps,
        )
