"""The vehicle as its drives taught it: the posterior of its parameters, and what weighing needs besides."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Final

import numpy as np
from annotated_types import Ge, Gt

from gateway.core.vehicle import UNKNOWN_OFFSET_STD_M, Load
from gateway.core.weights.on_the_road import Unsprung
from gateway.estimates.batch_estimate import Quantity
from gateway.metadata import STRICT
from gateway.model.car import LEAST_SLACK, Ground
from gateway.model.spectra import Reading, UsualFloor, mount_of
from gateway.model.table import INDEX, N
from gateway.records import F64

Positive = Annotated[float, Gt(0.0)]
NonNegative = Annotated[float, Ge(0.0)]
_POSITIVE: Final = {"gt": 0.0}
_GYRATION: Final = INDEX["payload_gyration_m2"]


@dataclass(frozen=True)
class VehicleModel:
    """A vehicle's posterior, as plain numbers and arrays.

    parameters (n,) and covariance (n, n) follow ``names`` (table.NAMES, those of roll only if a roll rate was used).
    directions (n, k) is the part of a root of the covariance that moves loads most: independent causes of unit
    variance. model_std is the model's own error in payload (kg), front share (%) and lateral place (m), and spread the
    factor by which intervals are wider than the model says; both are shown by drives left out.
    misfit_limit is the largest accepted misfit. The two amplitudes are root mean squares within the band;
    usual_log_amplitude and usual_stroke_mps are what friction refers to (spectra.Reading). gravity_mps2 is the mean
    reading of the accelerometer, floor each sensor's noise (spectra.usual_floor), gyro_gain the gyro's gain relative to
    the accelerometer's in bends with its standard deviation; None: unknown. taught_loads are the loads of the drives,
    as stated or as found.
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
    spread: tuple[Positive, Positive, Positive]
    misfit_limit: float = field(metadata=_POSITIVE)
    acceleration_rms_mps2: float = field(metadata=_POSITIVE)
    pitch_rate_rms_radps: float = field(metadata=_POSITIVE)
    speed_seen_mps: tuple[float, float]
    taught_loads: tuple[Load, ...]
    usual_log_amplitude: float
    usual_stroke_mps: tuple[Positive, Positive] | None = None
    warnings: tuple[str, ...] = ()
    gravity_mps2: float | None = field(default=None, metadata=_POSITIVE)
    track_width_m: float | None = field(default=None, metadata=_POSITIVE)
    sensor_left_m: float = 0.0
    sensor_left_std_m: float = field(default=UNKNOWN_OFFSET_STD_M, metadata=_POSITIVE)
    least_slack: float = field(default=LEAST_SLACK, metadata=_POSITIVE)
    floor: UsualFloor | None = None
    gyro_gain: tuple[Positive, Positive] | None = None

    @cached_property
    def ground(self) -> Ground:
        """The vehicle as stated, in the model's terms."""
        share = self.empty_front_share_pct / 100.0
        return Ground(self.empty_mass_kg, share, self.wheelbase_m, self.track_width_m, self.least_slack)

    @property
    def has_roll(self) -> bool:
        """Whether a roll rate was used."""
        return len(self.names) > N

    @property
    def payload_seen_kg(self) -> tuple[float, float]:
        """The lightest and the heaviest load of the drives."""
        loads = [load.payload_kg for load in self.taught_loads]
        return min(loads), max(loads)

    @property
    def front_share_seen_pct(self) -> tuple[float, float]:
        """The least and the largest front share of the drives."""
        shares = [load.front_share_pct for load in self.taught_loads]
        return min(shares), max(shares)

    @property
    def known_shape(self) -> tuple[float, float]:
        """Squared radius of gyration of compact loads in pitch (m2), and the standard deviation of its logarithm."""
        return float(np.exp(self.parameters[_GYRATION])), float(np.sqrt(self.covariance[_GYRATION, _GYRATION]))

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
        """The settings by which spectra of this vehicle are computed."""
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

    def with_warning(self, warning: str) -> "VehicleModel":
        """This vehicle with one more warning."""
        return replace(self, warnings=(*self.warnings, warning))
