"""Has the roll rate the sign that the signal map gives it? Tested for all runs together: they share one map.

Above its own resonances the body moves as forces along the centre line make it, so the acceleration follows the roll
acceleration as if it were measured y_s - b y_cg to the left: y_s the sensor's place, y_cg the centre of gravity's, b >
0. The campaign states both places, nobody measures them here; each gives the sign if it exceeds the scatter: a sensor
well off the centre line, or loads well to one side. Otherwise, or if the two contradict each other, the sign stays
unknown.

Measured on 54 recorded drives of a multi-body simulator and 47 of gateway/sim: b is 0.6 to 2.7; put right by b = 1.7
the lever arm is 0.5 to 1.5 times y_s for a sensor 0.15 m or more off the centre line, with a scatter of 0.05 m from run
to run.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, sqrt
from typing import Final

import numpy as np

from gateway.calibration.inspection.roll import roll_spectra_of
from gateway.calibration.known_run import KnownRun
from gateway.core.vehicle import Vehicle, cg_left_m
from gateway.estimate import Z95

BAND_HZ: Final = (6.0, 13.0)  # chosen: above the body's resonances
BY_CG: Final = 1.7  # b, the middle of the measured 0.6 to 2.7 (above)
BY_CG_STD: Final = 1.0  # chosen: of b, covers the measured range
LEVER_STD_M: Final = 0.05  # the measured scatter from run to run (above)
LEAST_OFFSET_M: Final = 0.15  # of the sensor, the least that was measured (above)
LEAST_SCORE: Final = 4.0  # chosen: standard deviations, of the sensor's place and of the sign
LEAST_RATIO: Final = 0.4  # chosen: of the lever arm and the sensor's place


@dataclass(frozen=True, slots=True)
class Rolled:
    """One run: the lever arm from its spectra, and the position of its centre of gravity left of the centre line."""

    lever_m: float
    cg_left_m: float
    cg_left_std_m: float
    is_stated: bool


@dataclass(frozen=True, slots=True)
class RollSign:
    """1 if the roll rate's sign is right, -1 if it is inverted, 0 if the drives do not show it; and why."""

    sign: int
    why: str


def roll_sign_of(runs: Sequence[KnownRun], vehicle: Vehicle) -> RollSign | None:
    """The combined evidence of these runs; None if none has a roll rate."""
    seen = [rolled for run in runs if (rolled := _rolled(run, vehicle)) is not None]
    if not seen:
        return None
    told = [one for one in (_by_sensor(seen, vehicle), _by_loads(seen)) if one is not None]
    signs = {one.sign for one in told}
    if len(signs) == 1:
        return RollSign(signs.pop(), "; ".join(one.why for one in told))
    if told:
        return RollSign(0, f"{told[0].why}, but {told[1].why}: one of them is stated wrong")
    offset_m, std_m = vehicle.sensor_left_m, vehicle.sensor_left_std_m
    sits = f"the sensor sits {offset_m:g} ± {Z95 * std_m:.2g} m left of the centre line"
    return RollSign(0, f"{sits}, and no load is known to be far enough to one side")


def _rolled(run: KnownRun, vehicle: Vehicle) -> Rolled | None:
    spectra = roll_spectra_of(run.batches)
    if spectra is None:
        return None
    at_m = cg_left_m(vehicle, run.payload_kg, run.payload_left_m or 0.0)
    std_m = run.payload_left_std_m * run.payload_kg / (vehicle.empty_mass_kg + run.payload_kg)
    return Rolled(spectra.lever_m(*BAND_HZ), at_m, std_m, run.payload_kg == 0.0 or run.payload_left_m is not None)


def _by_sensor(runs: Sequence[Rolled], vehicle: Vehicle) -> RollSign | None:
    """The lever arm without the loads' effect, compared with the sensor's stated position."""
    offset_m = vehicle.sensor_left_m
    if abs(offset_m) < max(LEAST_OFFSET_M, LEAST_SCORE * vehicle.sensor_left_std_m):
        return None
    stds_m = [hypot(LEVER_STD_M, BY_CG * run.cg_left_std_m, BY_CG_STD * run.cg_left_m) for run in runs]
    weights = np.array(stds_m) ** -2
    ratio = float(np.average([run.lever_m + BY_CG * run.cg_left_m for run in runs], weights=weights)) / offset_m
    std = 1.0 / sqrt(float(np.sum(weights))) / abs(offset_m)
    if abs(ratio) < max(LEAST_RATIO, LEAST_SCORE * std):
        return None
    side = "the side" if ratio > 0.0 else "the other side than that"
    why = f"acceleration and roll rate put the sensor on {side} of sensor_offset_left_m = {offset_m:g}"
    return RollSign(int(np.sign(ratio)), why)


def _by_loads(runs: Sequence[Rolled]) -> RollSign | None:
    """The dependence of the lever arm on the loads' stated positions."""
    stated = [run for run in runs if run.is_stated]
    if len(stated) < 2:
        return None
    x, y = (np.array(column) for column in zip(*((run.cg_left_m, run.lever_m) for run in stated), strict=True))
    x, y = x - x.mean(), y - y.mean()
    spread_m2 = float(np.sum(x**2))
    if spread_m2 == 0.0:
        return None
    slope = float(np.sum(x * y)) / spread_m2
    scatter_m = sqrt(float(np.sum((y - slope * x) ** 2)) / max(len(stated) - 2, 1))
    if abs(slope) < LEAST_SCORE * max(scatter_m, LEVER_STD_M) / sqrt(spread_m2):
        return None
    side = "the side" if slope < 0.0 else "the other side than that"
    return RollSign(-int(np.sign(slope)), f"acceleration and roll rate put loads on {side} of payload_left_m")
