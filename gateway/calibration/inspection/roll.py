"""The roll rate compared with the other two sensors: is it a roll rate, in which unit, and with which sign?

Its size is compared with the pitch rate's from 6 to 13 Hz, above the resonances of the body, whose height differs from
vehicle to vehicle: there the ratio follows from the inertias, the track and the wheelbase. It was measured on 99
recorded drives of two multi-body simulators, two of a real car and 6 of gateway/sim: seven vans and a small bus with
solid axles, loads to either side, mounts turned by a few degrees, town to motorway.

The sign is tested for all runs together, because they share one signal map. Above its own resonances the body moves as
forces along the centre line make it, so the acceleration follows the roll acceleration as if it were measured y_s - b
y_cg to the left: y_s is the sensor's place, y_cg that of the centre of gravity, b > 0. The campaign states both places,
with their doubts, so the lever arms of all runs have a Gaussian likelihood for either sign of the roll rate. A sensor
well off the centre line shows the sign, or loads well to one side. Otherwise, or if what is stated fits neither sign,
the sign stays unknown. On simulated drives b is 0.6 to 2.7; corrected with b = 1.7 the lever arm is 0.5 to 1.5 times
y_s for a sensor 0.15 m or more off the centre line, with a scatter of 0.05 m from run to run.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, isfinite, sqrt
from typing import Final

import numpy as np

from gateway.calibration.inspection.axes import reading_of
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.late import special
from gateway.core.vehicle import PAYLOAD_LEFT_NOTED_STD_M, PAYLOAD_LEFT_STD_M, Vehicle, cg_left_m
from gateway.estimates.quantity import Z95
from gateway.model.spectra import CrossSpectra, cross_spectra_of

ABOVE_BODY_HZ: Final = (6.0, 13.0)  # chosen: above the body's resonances
BY_CG: Final = 1.7  # b, the middle of the measured 0.6 to 2.7 (above)
BY_CG_STD: Final = 0.5  # a quarter of the measured range
LEVER_STD_M: Final = 0.05  # the measured scatter from run to run (above)
LEVER_SHARE: Final = 0.25  # half the measured spread of the lever arm over the sensor's place (above)
LEAST_SCORE: Final = 5.0  # chosen: root of the difference of chi-squared between the two signs, e^12.5 in odds
SELDOM: Final = 1e-3  # chosen: probability of doubting what is stated
EXCHANGED: Final = [0, 2, 1, 5, 6, 3, 4, 7, 8]  # parts of spectra, pitch and roll rate exchanged; conjugates need none


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
class RollSign:
    """1 if the roll rate's sign is right, -1 if it is inverted, 0 if the drives do not show it; and why."""

    sign: int
    why: str


def roll_sign_of(runs: Sequence[StatedDrive], vehicle: Vehicle) -> RollSign | None:
    """The combined evidence of these runs; None if none has a roll rate."""
    rows = [row for run in runs if (row := _rolled(run, vehicle)) is not None]
    if not rows:
        return None
    seen_m, cg_m, cg_std_m = np.array(rows).T
    sensor_m, sensor_std_m = (
        vehicle.sensor_left_m,
        hypot(vehicle.sensor_left_std_m, LEVER_SHARE * vehicle.sensor_left_m),
    )
    covariance = sensor_std_m**2 + np.outer(cg_m, cg_m) * BY_CG_STD**2
    covariance += np.diag(LEVER_STD_M**2 + (BY_CG * cg_std_m) ** 2)
    expected_m = sensor_m - BY_CG * cg_m
    right, inverted = (
        float(off @ np.linalg.solve(covariance, off)) for off in (seen_m - expected_m, seen_m + expected_m)
    )
    places = f"sensor_offset_left_m = {sensor_m:g} and payload_left_m"
    if min(right, inverted) > special.chdtri(len(rows), SELDOM):
        return RollSign(0, f"acceleration and roll rate fit {places} with neither sign: one of them is stated wrong")
    if abs(inverted - right) < LEAST_SCORE**2:
        sits = f"the sensor sits {sensor_m:g} ± {Z95 * vehicle.sensor_left_std_m:.2g} m left of the centre line"
        return RollSign(0, f"{sits}, and no load is known to be far enough to one side")
    side = "the side" if right < inverted else "the other side than that"
    return RollSign(
        1 if right < inverted else -1, f"acceleration and roll rate put sensor and loads on {side} of {places}"
    )


def _rolled(run: StatedDrive, vehicle: Vehicle) -> tuple[float, float, float] | None:
    """The lever arm from the spectra, the stated place of the centre of gravity, and its standard deviation (m)."""
    spectra = cross_spectra_of(run.batches, reading_of(vehicle))
    if spectra is None or not spectra.has_roll:
        return None
    payload_kg = (
        run.payload_kg if isfinite(run.payload_kg) else vehicle.payload_range_kg[1]
    )  # an unknown one may be any
    left_m = run.statement.left_m
    left_std_m = PAYLOAD_LEFT_STD_M if left_m is None else PAYLOAD_LEFT_NOTED_STD_M
    std_m = left_std_m * payload_kg / (vehicle.empty_mass_kg + payload_kg)
    return lever_m(spectra), cg_left_m(vehicle, payload_kg, left_m or 0.0), std_m
