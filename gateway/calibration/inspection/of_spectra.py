"""Checks of one drive's cross-spectra: axes, units and signs of the sensors, the speed's unit, the sensor's place."""

from math import isfinite, pi, sqrt
from typing import Final

import numpy as np

from gateway.calibration.as_stated import stated_run
from gateway.calibration.inspection.axes import Phases, fitted_position_m, mean_coherence
from gateway.calibration.inspection.finding import Severity
from gateway.calibration.inspection.roll import exchanged, over_pitch, pitch_coherence
from gateway.calibration.inspection.seen import Said, Seen
from gateway.model.spectra import CrossSpectra
from gateway.quantity import Z95
from gateway.records import Signal

SMOOTH_MPS2: Final = 0.08  # chosen: the quietest ordinary road shakes a vehicle more, in the estimators' band
STEPS_SHARE_MAX: Final = 0.1  # chosen: of a signal's power in that band
LEAST_COHERENCE: Final = 0.4  # chosen: behind the axles right axes have 0.45 and more, roll or yaw for pitch below 0.35
LEAST_AGREEMENT: Final = 0.62  # chosen: right axes amidships have 0.65 and more at any speed variation
USUAL_SCALE: Final = (0.5, 1.6)  # chosen: right axes are within 0.6 to 1.15, roll above 2.3
SCALE_RANGE: Final = (0.4, 2.5)  # chosen: no road vehicle's pitch rate is further from the usual vehicle's
UNIT_RANGE: Final = (0.5, 2.0)  # chosen: of a ratio that a wrong unit explains
ROLL_RANGE: Final = (0.9, 8.0)
"""Of roll over pitch rate above the body's resonances: measured 1.2 to 3.6 where the axes are right, 0.11 to 0.67 with
yaw in place of roll.
"""
ROLL_UNIT_RANGE: Final = (0.9, 5.0)  # chosen: of that ratio after degrees and radians are corrected
ALIKE: Final = 0.7  # coherence of roll and pitch rate: measured at most 0.13 with right axes; 1 for one signal twice
POSITION_OFF_M: Final = 0.3  # chosen: deviation that is reported
POSITION_WRONG_M: Final = 1.0  # chosen: deviation that excludes the run
PLACING_SEGMENTS: Final = 20  # chosen: for a place; a sign needs fewer
_DEGREES: Final = 180.0 / pi  # per radian


def apart(spectra: CrossSpectra, read: Phases) -> Said:
    """Do the two sensors move together as one body does?

    Amidships heave and pitch are nearly independent if the speed varies, so a low coherence alone proves nothing: there
    the phases and the size must at least match a vehicle's.
    """
    coherence, likely = mean_coherence(spectra), read.likely
    is_vehicle = likely.best >= LEAST_AGREEMENT and USUAL_SCALE[0] <= likely.scale <= USUAL_SCALE[1]
    if coherence < LEAST_COHERENCE and not is_vehicle:
        text = f"coherence of pitch_rate and vertical_acceleration is {coherence:.2f}, and their phases agree with a "
        yield f"{text}vehicle's by {likely.best:.2f}"


def wrong_size(read: Phases) -> Said:
    """A pitch rate far too large or too small for the vertical acceleration."""
    scale = read.likely.scale
    if not SCALE_RANGE[0] <= scale <= SCALE_RANGE[1]:
        text = f"pitch_rate is {scale:.3g} times that of a vehicle with this vertical acceleration"
        yield text + _slip(scale, UNIT_RANGE)


def _is_pitch(spectra: CrossSpectra, read: Phases, corrected: Phases) -> bool:
    return not any((*apart(spectra, read), *wrong_size(corrected)))


def _slip(ratio: float, within: tuple[float, float]) -> str:
    """The mistake of a rate's unit that leaves a ratio to the expected ``within`` this range; empty if none does."""
    if within[0] <= ratio / _DEGREES <= within[1]:
        return ": deg/s read as rad/s"
    return ": rad/s read as deg/s" if within[0] <= ratio * _DEGREES <= within[1] else ""


def _is_roll(spectra: CrossSpectra) -> bool:
    return pitch_coherence(spectra) <= ALIKE and ROLL_RANGE[0] <= over_pitch(spectra) <= ROLL_RANGE[1]


def rates_swapped(seen: Seen) -> Said:
    """Pitch rate is none, but the roll rate is a sound pitch rate, and the pitch rate then a sound roll rate."""
    if _is_pitch(seen.spectra, seen.as_read, seen.corrected):
        return
    other = exchanged(seen.spectra)
    read = seen.phases(other)
    if _is_roll(other) and _is_pitch(other, read, read):
        text = f"the phases agree with the vehicle's by {read.best:.2f} when exchanged, "
        yield f"{text}else by {seen.corrected.best:.2f}"


def speed_unit(seen: Seen) -> Said:
    """A mistake of the speed's unit that explains the phases."""
    if seen.misread is not None:
        what, read = seen.misread
        yield f"the phases agree with the vehicle's by {read.best:.2f} if {what}, and by far less otherwise"


def pitch_sign(seen: Seen) -> Said:
    """A pitch rate that fits only when inverted."""
    read = seen.corrected
    if read.is_turned:
        text = f"the phases agree with the vehicle's by {read.turned.best:.2f} with the opposite sign, "
        yield f"{text}by {read.upright.best:.2f} with this one"


def roll_axis(seen: Seen) -> Said:
    """A roll rate that repeats the pitch rate, or moves as no body rolls."""
    if (coherence := pitch_coherence(seen.spectra)) > ALIKE:
        yield f"its coherence with pitch_rate is {coherence:.2f}"
    elif (ratio := over_pitch(seen.spectra)) < ROLL_RANGE[0] and not _slip(ratio, ROLL_UNIT_RANGE):
        yield f"roll_rate moves {ratio:.3g} times as much as pitch_rate: a body that rolls moves more"


def roll_unit(seen: Seen) -> Said:
    """A roll rate far too large or too small for the pitch rate."""
    ratio = over_pitch(seen.spectra)
    if not ROLL_RANGE[0] <= ratio <= ROLL_RANGE[1]:
        yield f"roll_rate moves {ratio:.3g} times as much as pitch_rate" + _slip(ratio, ROLL_UNIT_RANGE)


def position(seen: Seen) -> Said:
    """The sensor's position by this run alone, compared with the campaign's; signs and units being right."""
    vehicle = seen.vehicle
    if seen.spectra.n_total < PLACING_SEGMENTS:
        return
    position_m, std_m = fitted_position_m(stated_run(seen.drive.run, seen.spectra, vehicle), vehicle)
    off_m = abs(position_m - vehicle.sensor_position_m)
    doubt_m = 3.0 * float(np.hypot(std_m, vehicle.sensor_position_std_m))
    if off_m > max(POSITION_OFF_M, doubt_m):
        by_spectra = f"{position_m:.2f} ± {Z95 * std_m:.2f} m (95 %)"
        text = f"sensor_position_m is {vehicle.sensor_position_m:g}, the spectra say {by_spectra}"
        yield text, Severity.FAULT if off_m > max(POSITION_WRONG_M, doubt_m) else Severity.WARNING


def smooth(seen: Seen) -> Said:
    """A vehicle that hardly shakes."""
    if (rms_mps2 := seen.spectra.acceleration_rms_mps2 * abs(seen.gravity.factor)) < SMOOTH_MPS2:
        yield f"vertical acceleration is {rms_mps2:.2g} m/s2 (root mean square)"


def coarse(seen: Seen) -> Said:
    """Signals whose resolution is a large part of them."""
    spectra = seen.spectra
    low_hz, high_hz = spectra.freq_hz[1], spectra.freq_hz[-2]
    pitch_rms = spectra.pitch_rate_rms_radps
    rms = {Signal.VERTICAL_ACCELERATION: spectra.acceleration_rms_mps2, Signal.PITCH_RATE: pitch_rms}
    if spectra.has_roll:
        rms[Signal.ROLL_RATE] = pitch_rms * over_pitch(spectra, (low_hz, high_hz))
    for signal, moved in rms.items():
        stream = seen.streams.get(signal)
        if stream is not None and isfinite(stream.resolution) and stream.rate_hz > 0.0:
            steps = stream.resolution * sqrt((high_hz - low_hz) / (6.0 * stream.rate_hz))  # q^2 / 12 over half the rate
            if (share := (steps / max(moved, np.finfo(float).tiny)) ** 2) > STEPS_SHARE_MAX:
                yield f"{min(share, 1.0):.0%} of the power of {signal} comes from its steps of {stream.resolution:.3g}"
