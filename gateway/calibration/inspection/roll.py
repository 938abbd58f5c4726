"""The roll rate compared with the other two sensors: is it a roll rate, in which unit, and with which sign?

Its size is compared with the pitch rate's from 6 to 13 Hz, above the resonances of the body, whose height differs from
vehicle to vehicle: there the ratio follows from the inertias, the track and the wheelbase. It was measured on 99
recorded drives of two multi-body simulators, two of a real car and 6 of gateway/sim: seven vans and a small bus with
solid axles, loads to either side, mounts turned by a few degrees, town to motorway.

The sign is tested for all runs together, because they share one signal map. Above its own resonances the body moves as
forces along the centre line make it, so the acceleration follows the roll acceleration as if it were measured y_s - b
y_cg to the left: y_s is the sensor's place, y_cg that of the centre of gravity, b > 0. The campaign states both places.
Each shows the sign if it exceeds the scatter: a sensor well off the centre line, or loads well to one side. Otherwise,
or if the two contradict each other, the sign stays unknown. On simulated drives b is 0.6 to 2.7; corrected with b = 1.7
the lever arm is 0.5 to 1.5 times y_s for a sensor 0.15 m or more off the centre line, with a scatter of 0.05 m from run
to run.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, isfinite, sqrt
from typing import Final

import numpy as np

from gateway.calibration.inspection.axes import reading_of
from gateway.calibration.known_run import KnownRun
from gateway.core.vehicle import Vehicle, cg_left_m
from gateway.model.spectra import CrossSpectra, cross_spectra_of
from gateway.quantity import Z95

ABOVE_BODY_HZ: Final = (6.0, 13.0)  # chosen: above the body's resonances
BY_CG: Final = 1.7  # b, the middle of the measured 0.6 to 2.7 (above)
BY_CG_STD: Final = 1.0  # chosen: of b, covers the measured range
LEVER_STD_M: Final = 0.05  # the measured scatter from run to run (above)
LEAST_OFFSET_M: Final = 0.15  # of the sensor, the least that was measured (above)
LEAST_SCORE: Final = 4.0  # chosen: standard deviations, of the sensor's place and of the sign
LEAST_RATIO: Final = 0.4  # chosen: of the lever arm and the sensor's place
_EXCHANGED: Final = [0, 2, 1, 5, 6, 3, 4, 7, 8]  # parts of spectra; the conjugate of the last is not needed


def exchanged(spectra: CrossSpectra) -> CrossSpectra:
    """Spectra of three sensors as if the map exchanged pitch and roll rate."""
    return spectra.showing(spectra.parts[_EXCHANGED])


def over_pitch(spectra: CrossSpectra, band_hz: tuple[float, float] = ABOVE_BODY_HZ) -> float:
    """Roll over pitch rate within ``band_hz``, of the root mean squares."""
    _, pitch, roll = np.sum(spectra.n_segments * spectra.within(band_hz).parts[:3], axis=(1, 2))
    return sqrt(float(roll) / max(float(pitch), np.finfo(float).tiny))


def pitch_coherence(spectra: CrossSpectra) -> float:
    """Of roll and pitch rate, 0..1, the mean over frequency."""
    parts = np.sum(spectra.n_segments * spectra.parts, axis=1)
    return float(np.mean((parts[7] ** 2 + parts[8] ** 2) / np.maximum(parts[1] * parts[2], np.finfo(float).tiny)))


def lever_m(spectra: CrossSpectra) -> float:
    """Apparent distance of the acceleration's measurement left of the roll axis.

    Re sum S_ap / sum S_pp, p the roll acceleration j 2 pi f times the roll rate. For a load amidships it has the sign
    of the sensor's place; a load to one side correlates heave and roll, and shifts it.
    """
    above = spectra.within(ABOVE_BODY_HZ)
    turn = 2.0 * np.pi * above.freq_hz[1:-1]
    # S_ra = real + j imaginary is the roll rate times the conjugate of the acceleration, so Re S_ap = -turn Im S_ra.
    parts = np.sum(spectra.n_segments * above.parts, axis=1)
    return float(-np.sum(turn * parts[6]) / max(float(np.sum(turn**2 * parts[2])), np.finfo(float).tiny))


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
    evidence = [one for one in (_by_sensor(seen, vehicle), _by_loads(seen)) if one is not None]
    signs = {one.sign for one in evidence}
    if len(signs) == 1:
        return RollSign(signs.pop(), "; ".join(one.why for one in evidence))
    if evidence:
        return RollSign(0, f"{evidence[0].why}, but {evidence[1].why}: one of them is stated wrong")
    sits = (
        f"the sensor sits {vehicle.sensor_left_m:g} ± {Z95 * vehicle.sensor_left_std_m:.2g} m left of the centre line"
    )
    return RollSign(0, f"{sits}, and no load is known to be far enough to one side")


def _rolled(run: KnownRun, vehicle: Vehicle) -> Rolled | None:
    spectra = cross_spectra_of(run.batches, reading_of(vehicle))
    if spectra is None or not spectra.has_roll:
        return None
    payload_kg = run.payload_kg if isfinite(run.payload_kg) else 0.0
    std_m = run.payload_left_std_m * payload_kg / (vehicle.empty_mass_kg + payload_kg)
    at_m = cg_left_m(vehicle, payload_kg, run.payload_left_m or 0.0)
    return Rolled(lever_m(spectra), at_m, std_m, run.payload_kg == 0.0 or run.payload_left_m is not None)


def _by_sensor(runs: Sequence[Rolled], vehicle: Vehicle) -> RollSign | None:
    """The lever arm without the loads' effect, compared with the sensor's stated position."""
    offset_m = vehicle.sensor_left_m
    if abs(offset_m) < max(LEAST_OFFSET_M, LEAST_SCORE * vehicle.sensor_left_std_m):
        return None
    stds_m = [hypot(LEVER_STD_M, BY_CG * run.cg_left_std_m, BY_CG_STD * run.cg_left_m) for run in runs]
    weights = np.array(stds_m) ** -2
    ratio = float(np.average([run.lever_m + BY_CG * run.cg_left_m for run in runs], weights=weights)) / offset_m
    if abs(ratio) < max(LEAST_RATIO, LEAST_SCORE / sqrt(float(np.sum(weights))) / abs(offset_m)):
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
