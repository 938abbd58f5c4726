"""What it costs that nobody said what the vehicle carries: the width of a weight now, and once it is said.

stated_widths(calibration, vehicle, speed_mps) -> half-widths in kg, as the service would state them for one batch
"""

from dataclasses import asdict, dataclass, replace
from typing import Any, Final

from gateway.calibration.plan.design import BATCH_S
from gateway.core.cargo import is_said, shape_prior
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.ideal_drive import Drive
from gateway.core.cross_spectrum.predicted import predicted
from gateway.core.vehicle import Carries, Load, Vehicle, front_share_pct
from gateway.posterior import PAYLOAD

TYPICAL_PART: Final = 0.5  # of the most payload
TYPICAL_PLACE: Final = 0.5  # of the wheelbase, behind the front axle
COMPACT_LENGTH_M: Final = 0.8  # one pallet's, as an example of a length that is said


@dataclass(frozen=True, slots=True)
class StatedWidths:
    """Half the 95 % interval (kg) of one batch under ``payload_kg``, amid the wheelbase: with what is said of the loads
    now, with each kind of goods that ``carries`` may name, and with a payload_length_m of 0.8.
    """

    payload_kg: float
    now_kg: float
    carries_kg: dict[Carries, float]
    compact_kg: float

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return asdict(self)


def stated_widths(known: CrossSpectrumCalibration, vehicle: Vehicle, speed_mps: float) -> StatedWidths | None:
    """None where the fitter said what the vehicle carries, or where one load alone was driven."""
    if is_said(vehicle) or known.payload_seen_kg[0] == known.payload_seen_kg[1]:
        return None
    payload_kg = TYPICAL_PART * vehicle.payload_range_kg[1]
    load = Load(payload_kg, front_share_pct(vehicle, payload_kg, TYPICAL_PLACE * vehicle.wheelbase_m))

    def half_width_kg(said: Vehicle) -> float:
        prior = shape_prior(said, *known.known_shape)
        low, high = predicted(known, prior, load, Drive(BATCH_S, speed_mps)).quantity(PAYLOAD).interval95
        return 0.5 * (high - low)

    kinds = [kind for kind in Carries if kind is not Carries.MIXED]
    return StatedWidths(
        payload_kg=payload_kg,
        now_kg=half_width_kg(vehicle),
        carries_kg={kind: half_width_kg(replace(vehicle, carries=kind)) for kind in kinds},
        compact_kg=half_width_kg(replace(vehicle, payload_length_m=COMPACT_LENGTH_M)),
    )
