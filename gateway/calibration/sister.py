"""A sister's calibration as the prior of the next vehicle of her model, so that one empty drive is enough.

    sister = sister_of(load_calibration(path))
    fit_cross_spectrum(runs, vehicle, inherited=sister)

Two vehicles of one model differ by N(0, S), where S is diagonal and known (SCATTER_STD). The prior of the next vehicle
is thus the sister's posterior with S added to its covariance. Parameters that are each vehicle's own (its sensor, its
noise, its tracks) keep the prior of any vehicle.

We read tolerances that makers state as limits as three standard deviations about the mean.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Final

import numpy as np

from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.half_car.fit import SPRINGS_FROM_PRIORS
from gateway.calibration.half_car.prior import Prior, prior_of
from gateway.calibration.inheritance import ModelLimits, Seen, Usual
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import (
    BEND_SHARES,
    PARAMETERS,
    ROLL_PARAMETERS,
    has_roll,
)
from gateway.core.vehicle import Vehicle
from gateway.errors import NoSisterError
from gateway.records import F64

MOST_WHEELBASE_DIFFERENCE: Final = 0.01  # chosen: of the wheelbase; a larger difference is another model
MOST_MASS_DIFFERENCE: Final = 0.25  # chosen: of the sprung mass; a larger difference is another body
_ENDS: Final = ("front", "rear")
_BEND_STD_PER_KN: Final = 0.01  # chosen: bump stops and helper springs have one part number

_OF_AXLE: Final[Mapping[str, float]] = MappingProxyType(
    {
        # makers of custom coils guarantee +-10 % of the rate (springs3d.com/en/tolerancias), car makers ask for less
        "spring_{}_npm": 0.03,
        "damper_{}_nspm": 0.10,  # wear, oil, makes; chosen: buyers agree on bands of their own
        # rubber of +-5 degrees Shore A (driventus.com on sourcing dampers) is +-20 % (gmt-rubber.com, figure 1.2)
        "damper_mount_{}_npm": 0.15,
        # chosen for a fleet that looks after its tyres, whose rate goes with the pressure: in a survey of 3950 light
        # trucks a third had one a quarter too low (NHTSA 2001)
        "tyre_{}_npm": 0.04,
        "unsprung_{}_kg": 0.03,  # wheels and tyres of other makes
        "damper_friction_{}": 0.05,  # chosen: a third of the 0.1 to 0.3 found in vans
        "spring_friction_{}": 0.02,  # likewise, of 0.03 to 0.09
        "spring_slope_{}_per_kn": 0.01,  # the coil's winding: a third of a usual slope of 0.03
    }
)
_OF_BODY: Final[Mapping[str, float]] = MappingProxyType(
    {
        "pitch_inertia_kgm2": 0.03,  # mass and centre of gravity differ by 1.5 %, its square by twice that
        "payload_gyration_m2": 0.3,  # loads, not vehicles
        "payload_mode_hz": 0.1,  # the same floor
        "payload_damping_ratio": 0.3,
        "rear_lag_s": 0.001,
        "roll_inertia_kgm2": 0.03,
        "payload_roll_gyration_m2": 0.3,
        "anti_roll_front_npm": 0.1,  # bars are steel; their bushes and links are not
        "anti_roll_rear_npm": 0.1,
        "damper_against_front": 0.1,
        "damper_against_rear": 0.1,
        "tracks_apart_m": 0.3,  # roads, not vehicles
        "twist_level": 0.3,
    }
)

SCATTER_STD: Final[Mapping[str, float]] = MappingProxyType(
    {name.format(end): std for name, std in _OF_AXLE.items() for end in _ENDS}
    | {f"spring_bend_{end}_{i}_per_kn": _BEND_STD_PER_KN for end in _ENDS for i in range(len(BEND_SHARES))}
    | dict(_OF_BODY)
)
"""Inherited parameters: standard deviation of the difference between two vehicles, relative for positive parameters,
else in the unit that ends the name. All others are each vehicle's own.
"""


@dataclass(frozen=True, slots=True)
class Sister:
    """A calibrated vehicle of the same model, with the id of her calibration file."""

    id: str
    vehicle: Vehicle
    calibration: CrossSpectrumCalibration

    @property
    def usual(self) -> Usual:
        """Her usual movement, which friction shares refer to. Raises NoSisterError if the calibration lacks it."""
        known = self.calibration
        if known.usual_log_amplitude is None:
            raise NoSisterError(f"{self.vehicle.name} ({self.id}): lacks its usual movement: calibrate it again")
        return Usual(known.usual_log_amplitude, known.usual_stroke_mps)

    @property
    def seen(self) -> Seen:
        """The loads, speeds and roads of her drives."""
        return Seen.of(self.calibration)

    def prior_of(self, vehicle: Vehicle, *, with_roll: bool) -> Prior:
        """The prior of ``vehicle``. Raises NoSisterError if it is of another model."""
        require_alike(self.vehicle, vehicle)
        generic = prior_of(vehicle, with_roll=with_roll)
        n, known = len(PARAMETERS), self.calibration
        half_car = _inherited(generic.upright, known.parameters[:n], known.covariance[:n, :n], PARAMETERS)
        if not with_roll:
            return half_car
        if not has_roll(known.parameters):
            return half_car.beside(generic.roll)
        roll = _inherited(generic.roll, known.parameters[n:], known.covariance[n:, n:], ROLL_PARAMETERS)
        return half_car.beside(roll)

    def on(self, calibration: CrossSpectrumCalibration, *, is_tested: bool) -> CrossSpectrumCalibration:
        """See half_car.inherited: the calibration valid over her ranges too, with her limits."""
        wider = ModelLimits.of(self.calibration).on(self.seen.on(calibration), is_tested=is_tested)
        low_kg, high_kg = wider.payload_seen_kg
        kept = tuple(one for one in wider.warnings if low_kg == high_kg or one != SPRINGS_FROM_PRIORS)
        return replace(wider, warnings=kept)


def sister_of(file: CalibrationFile) -> Sister:
    """The vehicle of a calibration file as a sister. Raises NoSisterError if it has no half-car."""
    if file.cross_spectrum is None:
        raise NoSisterError(
            f"{file.vehicle.name} ({file.id}): has no cross_spectrum calibration, which a sister needs: "
            "calibrate it again without --estimator ratio_index"
        )
    return Sister(file.id, file.vehicle, file.cross_spectrum)


def _inherited(generic: Prior, theta: F64, covariance: F64, names: tuple[str, ...]) -> Prior:
    """``generic`` with the inherited parameters replaced by N(theta, covariance + S)."""
    at = np.array([i for i, name in enumerate(names) if name in SCATTER_STD])
    block = np.ix_(at, at)
    scatter = np.array([SCATTER_STD[names[i]] for i in at])
    mean, precision = generic.mean.copy(), generic.precision.copy()
    mean[at] = theta[at]
    wider = np.linalg.inv(covariance[block] + np.diag(scatter**2))
    precision[block] = 0.5 * (wider + wider.T)
    return Prior(mean, precision)


def require_alike(sister: Vehicle, vehicle: Vehicle) -> None:
    """Raises NoSisterError if both cannot be of one model."""
    off_m, off_kg = vehicle.wheelbase_m - sister.wheelbase_m, vehicle.empty_mass_kg - sister.empty_mass_kg
    if abs(off_m) > MOST_WHEELBASE_DIFFERENCE * sister.wheelbase_m:
        raise NoSisterError(
            f"{vehicle.name}: wheelbase {vehicle.wheelbase_m:g} m, its sister's {sister.wheelbase_m:.4g} m: another "
            "model; give the calibration of a vehicle of its own model"
        )
    if abs(off_kg) > MOST_MASS_DIFFERENCE * sister.empty_mass_kg:
        raise NoSisterError(
            f"{vehicle.name}: sprung mass {vehicle.empty_mass_kg:g} kg, its sister's {sister.empty_mass_kg:.4g} kg: "
            "another body; give the calibration of a vehicle like it"
        )
