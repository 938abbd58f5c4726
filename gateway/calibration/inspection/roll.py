"""The roll rate compared with the other two sensors: is it present, is it a roll rate, and in which unit?

Shares and ratios are of the band in which the body moves. The usual values were measured on 54 recorded drives of a
multi-body simulator, two of a real car, and 47 of gateway/sim: three vans scattered, loads to either side, mounts
turned by a few degrees, town to motorway.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.calibration.half_car.known_spectra import N_SEGMENT
from gateway.calibration.inspection.explained import finding_of
from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.core.spectrum import BAND_HZ, frequencies_hz, segment_starts, segment_transforms
from gateway.core.vehicle import Vehicle
from gateway.estimate import Z95
from gateway.records import C128, F64, Batch

OVER_PITCH_RANGE: Final = (
    0.3,
    8.0,
)  # root mean squares: 0.45 to 2.1 where the axes are right, yaw for roll 0.02 to 0.21
UNIT_RANGE: Final = (0.4, 2.5)  # the same where degrees and radians are put right
DEGREES: Final = 180.0 / np.pi  # per radian
ALIKE: Final = (
    0.7  # coherence of roll and pitch rate: at most 0.13 where the axes are right, 1 of the same signal twice
)
LOST_SHARE_NOTED: Final = 0.02  # chosen: of the usable time
LEAST_SEGMENTS: Final = 6  # chosen: as core.cross_spectrum.measured
HARDLY_KNOWN_M: Final = 0.1  # chosen: standard deviation; a tape gives 0.02
ACCELERATION, PITCH, ROLL = range(3)


@dataclass(frozen=True, slots=True)
class RollMatrix:
    """Mean spectral matrix (3, 3, m) of acceleration, pitch and roll rate at freq_hz (m,), over n_segments."""

    freq_hz: F64
    matrix: C128
    n_segments: int

    def rms(self, sensor: int) -> float:
        """Root mean square within the band, in the sensor's SI unit."""
        power = np.real(self.matrix[sensor, sensor, self._within(*BAND_HZ)])
        return float(np.sqrt(np.sum(power) * (self.freq_hz[1] - self.freq_hz[0])))

    @property
    def over_pitch(self) -> float:
        """Roll over pitch rate, of the root mean squares."""
        return self.rms(ROLL) / max(self.rms(PITCH), np.finfo(float).tiny)

    @property
    def pitch_coherence(self) -> float:
        """Of roll and pitch rate, 0..1, the mean over the band."""
        m = self.matrix[:, :, self._within(*BAND_HZ)]
        auto = np.real(m[PITCH, PITCH]) * np.real(m[ROLL, ROLL])
        return float(np.mean(np.abs(m[PITCH, ROLL]) ** 2 / np.maximum(auto, np.finfo(float).tiny)))

    def lever_m(self, low_hz: float, high_hz: float) -> float:
        """Apparent distance of the acceleration's measurement left of the roll axis, by these frequencies.

        Re sum S_ap / sum S_pp, p the roll acceleration j 2 pi f times the roll rate. For a load amidships it has the
        sign of the sensor's place; a load to one side correlates heave and roll, and shifts it.
        """
        at = self._within(low_hz, high_hz)
        to_acceleration = 2j * np.pi * self.freq_hz[at]
        cross = self.matrix[ACCELERATION, ROLL, at] * np.conj(to_acceleration)
        auto = np.real(self.matrix[ROLL, ROLL, at]) * np.abs(to_acceleration) ** 2
        return float(np.sum(np.real(cross)) / max(float(np.sum(auto)), np.finfo(float).tiny))

    def _within(self, low_hz: float, high_hz: float) -> slice:
        return slice(*np.searchsorted(self.freq_hz, [low_hz, high_hz], side="left"))


def roll_spectra_of(batches: Sequence[Batch], n_segment: int = N_SEGMENT) -> RollMatrix | None:
    """Over all segments in which the three sensors are known; None if there are fewer than six, or no roll rate."""
    matrix, n_segments, freq_hz = np.zeros((3, 3, n_segment // 2 + 1), np.complex128), 0, np.empty(0)
    for batch in batches:
        if batch.roll_rate_radps is None:
            continue
        sensors = (batch.vertical_acceleration_mps2, batch.pitch_rate_radps, batch.roll_rate_radps)
        starts = segment_starts(batch.usable & np.isfinite(np.sum(sensors, axis=0)), n_segment, n_segment // 2)
        if starts.size:
            freq_hz = frequencies_hz(n_segment, batch.rate_hz)
            x = np.stack([segment_transforms(one, starts, n_segment, batch.rate_hz) for one in sensors])
            matrix += np.einsum("akf,bkf->abf", x, np.conj(x))
            n_segments += len(starts)
    return RollMatrix(freq_hz, matrix / n_segments, n_segments) if n_segments >= LEAST_SEGMENTS else None


def lost_findings(batches: Sequence[Batch]) -> Iterator[Finding]:
    """A roll rate that is mapped, and unknown for a good part of the time that can be used."""
    weights = [(batch.roll_usable_share, np.count_nonzero(batch.usable)) for batch in batches]
    known = [(share, n) for share, n in weights if share is not None and n > 0]
    if not known:
        return
    lost = 1.0 - float(np.average([share for share, _ in known], weights=[n for _, n in known]))
    if lost > LOST_SHARE_NOTED:
        yield finding_of(Kind.ROLL_RATE_LOST, Severity.WARNING, f"{lost:.1%} of the time that can be used")


def exchanged(batches: Sequence[Batch]) -> tuple[Batch, ...]:
    """As if the map exchanged the two rates."""
    return tuple(
        replace(batch, pitch_rate_radps=batch.roll_rate_radps, roll_rate_radps=batch.pitch_rate_radps)
        for batch in batches
        if batch.roll_rate_radps is not None
    )


def roll_findings(spectra: RollMatrix) -> Iterator[Finding]:
    """Axis and unit of the roll rate, if the pitch rate is right."""
    if spectra.pitch_coherence > ALIKE:
        text = f"its coherence with pitch_rate is {spectra.pitch_coherence:.2f}"
        yield finding_of(Kind.ROLL_RATE_AXIS, Severity.FAULT, text)
        return
    ratio = spectra.over_pitch
    if OVER_PITCH_RANGE[0] <= ratio <= OVER_PITCH_RANGE[1]:
        return
    text = f"roll_rate moves {ratio:.3g} times as much as pitch_rate"
    if UNIT_RANGE[0] <= ratio / DEGREES <= UNIT_RANGE[1]:
        yield finding_of(Kind.ROLL_RATE_UNIT, Severity.FAULT, f"{text}: deg/s taken for rad/s")
    elif UNIT_RANGE[0] <= ratio * DEGREES <= UNIT_RANGE[1]:
        yield finding_of(Kind.ROLL_RATE_UNIT, Severity.FAULT, f"{text}: rad/s taken for deg/s, or no roll rate at all")
    elif ratio < OVER_PITCH_RANGE[0]:
        yield finding_of(Kind.ROLL_RATE_AXIS, Severity.FAULT, f"{text}: no body that rolls does")
    else:
        yield finding_of(Kind.ROLL_RATE_UNIT, Severity.FAULT, text)


def unmapped_roll_findings(entry: str | None) -> Iterator[Finding]:
    """For a signal map without a roll rate; ``entry`` is a possible entry, None if no name suggests one."""
    found = f"the signal map could hold {entry}" if entry else "the pitch rate's message names none"
    yield finding_of(Kind.ROLL_RATE_UNMAPPED, Severity.NOTE, found)


def offset_findings(vehicle: Vehicle) -> Iterator[Finding]:
    """A sensor whose lateral position nobody measured."""
    std_m = vehicle.sensor_left_std_m
    if std_m > HARDLY_KNOWN_M:
        text = f"sensor_offset_left_m is {vehicle.sensor_left_m:g} ± {Z95 * std_m:.2g} m (95 %)"
        yield finding_of(Kind.SENSOR_OFFSET_UNKNOWN, Severity.NOTE, text)
