"""The effect of stating the vehicle's usual goods: intervals of one batch now, and after the answer.

stated_widths(calibration, vehicle, speed_mps) -> payload and half-width in kg, by kind of goods
"""

from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from gateway.calibration.plan.design import BATCH_S
from gateway.core.cargo import ShapePrior, is_said, shape_prior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.predicted import Drive, predicted
from gateway.core.vehicle import Carries, Load, Vehicle, front_share_pct
from gateway.posterior import PAYLOAD

TYPICAL_PART: Final = 0.5  # chosen: of the largest payload
TYPICAL_PLACE: Final = 0.5  # chosen: of the wheelbase, behind the front axle


@dataclass(frozen=True, slots=True)
class Stated:
    """The payload that one batch states, and half its 95 % interval."""

    payload_kg: float
    half_width_kg: float


@dataclass(frozen=True, slots=True)
class StatedOf:
    """The estimate of goods of one kind: before and after they are stated."""

    unsaid: Stated
    said: Stated


@dataclass(frozen=True, slots=True)
class StatedWidths:
    """The estimates of ``payload_kg`` in the middle of the wheelbase, for each kind of goods in ``carries``."""

    payload_kg: float
    carries: dict[Carries, StatedOf]

    def to_json(self) -> dict[str, Any]:
        """The figures as JSON."""
        return asdict(self)


def stated_widths(known: CrossSpectrumCalibration, vehicle: Vehicle, speed_mps: float) -> StatedWidths | None:
    """Estimates for a load with each kind's median shape. None if the fitter stated the goods, or a single load was
    driven.
    """
    if is_said(vehicle) or known.payload_seen_kg[0] == known.payload_seen_kg[1]:
        return None
    payload_kg = TYPICAL_PART * vehicle.payload_range_kg[1]
    load = Load(payload_kg, front_share_pct(vehicle, payload_kg, TYPICAL_PLACE * vehicle.wheelbase_m))
    drive = Drive(BATCH_S, speed_mps)
    nothing_said = shape_prior(vehicle, *known.known_shape)

    def stated(prior: ShapePrior, log_s: float) -> Stated:
        payload = predicted(known, prior, load, drive, log_s).quantity(PAYLOAD)
        low, high = payload.interval95
        return Stated(payload.number, 0.5 * (high - low))

    def stated_of(kind: Carries) -> StatedOf:
        said = shape_prior(replace(vehicle, carries=kind), *known.known_shape)
        return StatedOf(stated(nothing_said, said.median), stated(said, said.median))

    return StatedWidths(payload_kg, {kind: stated_of(kind) for kind in Carries if kind is not Carries.MIXED})
