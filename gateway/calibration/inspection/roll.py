"""The roll rate compared with the other two sensors: is it a roll rate, in which unit, and with which sign?

Shares and ratios are of the band in which the body moves. The usual values were measured on 54 recorded drives of a
multi-body simulator, two of a real car, and 47 of gateway/sim: three vans scattered, loads to either side, mounts
turned by a few degrees, town to motorway.

The sign is tested for all runs together, because they share one signal map. Above its own resonances the body moves as
forces along the centre line make it, so the acceleration follows the roll acceleration as if it were measured y_s - b
y_cg to the left: y_s is the sensor's place, y_cg that of the centre of gravity, b > 0. The campaign states both places.
Each shows the sign if it exceeds the scatter: a sensor well off the centre line, or loads well to one side. Otherwise,
or if the two contradict each other, the sign stays unknown. On the same simulated drives b is 0.6 to 2.7; corrected
with b = 1.7 the lever arm is 0.5 to 1.5 times y_s for a sensor 0.15 m or more off the centre line, with a scatter of
0.05 m from run to run.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import hypot, sqrt
from typing import Final

import numpy as np

from gateway.calibration.half_car.known_spectra import N_SEGMENT
from gateway.calibration.inspection.axes import unit_slip
from gateway.calibration.inspection.finding import Finding, Kind
from gateway.calibration.known_run import KnownRun
from gateway.core.spectrum import BAND_HZ, frequencies_hz, segment_starts, segment_transforms
from gateway.core.vehicle import Vehicle, cg_left_m
from gateway.estimate import Z95
from gateway.records import C128, F64, Batch

OVER_PITCH_RANGE: Final = (0.3, 8.0)
"""Of root mean squares: measured 0.45 to 2.1 where the axes are right, 0.02 to 0.21 with yaw in place of roll."""
UNIT_RANGE: Final = (0.4, 2.5)  # the same range after degrees and radians are corrected
ALIKE: Final = 0.7  # coherence of roll and pitch rate: measured at most 0.13 with right axes; 1 for one signal twice
LOST_SHARE_NOTED: Final = 0.02  # chosen: of the usable time
LEAST_SEGMENTS: Final = 6  # chosen: as core.cross_spectrum.measured
HARDLY_KNOWN_M: Final = 0.1  # chosen: standard deviation; a tape gives 0.02
SIGN_BAND_HZ: Final = (6.0, 13.0)  # chosen: above the body's resonances
BY_CG: Final = 1.7  # b, the middle of the measured 0.6 to 2.7 (above)
BY_CG_STD: Final = 1.0  # chosen: of b, covers the measured range
LEVER_STD_M: Final = 0.05  # the measured scatter from run to run (above)
LEAST_OFFSET_M: Final = 0.15  # of the sensor, the least that was measured (above)
LEAST_SCORE: Final = 4.0  # chosen: standard deviations, of the sensor's place and of the sign
LEAST_RATIO: Final = 0.4  # chosen: of the lever arm and the sensor's place
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


def roll_spectra_of(batches: Sequence[Batch]) -> RollMatrix | None:
    """Over all segments in which the three sensors are known; None if there are fewer than six, or no roll rate."""
    matrix, n_segments, freq_hz = np.zeros((3, 3, N_SEGMENT // 2 + 1), np.complex128), 0, np.empty(0)
    for batch in batches:
        if batch.roll_rate_radps is None:
            continue
        sensors = (batch.vertical_acceleration_mps2, batch.pitch_rate_radps, batch.roll_rate_radps)
        starts = segment_starts(batch.usable & np.isfinite(np.sum(sensors, axis=0)), N_SEGMENT, N_SEGMENT // 2)
        if starts.size:
            freq_hz = frequencies_hz(N_SEGMENT, batch.rate_hz)
            x = np.stack([segment_transforms(one, starts, N_SEGMENT, batch.rate_hz) for one in sensors])
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
        yield Finding.of(Kind.ROLL_RATE_LOST, f"{lost:.1%} of the time that can be used")


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
        yield Finding.of(Kind.ROLL_RATE_AXIS, text)
        return
    ratio = spectra.over_pitch
    if OVER_PITCH_RANGE[0] <= ratio <= OVER_PITCH_RANGE[1]:
        return
    text, slip = f"roll_rate moves {ratio:.3g} times as much as pitch_rate", unit_slip(ratio, UNIT_RANGE)
    if ratio < OVER_PITCH_RANGE[0] and not slip:
        yield Finding.of(Kind.ROLL_RATE_AXIS, f"{text}: a body that rolls moves more")
    else:
        perhaps = ", or no roll rate at all" if ratio < 1.0 else ""
        yield Finding.of(Kind.ROLL_RATE_UNIT, text + slip + perhaps)


def offset_findings(vehicle: Vehicle) -> Iterator[Finding]:
    """A sensor whose lateral position nobody measured."""
    std_m = vehicle.sensor_left_std_m
    if std_m > HARDLY_KNOWN_M:
        text = f"sensor_offset_left_m is {vehicle.sensor_left_m:g} ± {Z95 * std_m:.2g} m (95 %)"
        yield Finding.of(Kind.SENSOR_OFFSET_UNKNOWN, text)


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
    offset_m, std_m = vehicle.sensor_left_m, vehicle.sensor_left_std_m
    sits = f"the sensor sits {offset_m:g} ± {Z95 * std_m:.2g} m left of the centre line"
    return RollSign(0, f"{sits}, and no load is known to be far enough to one side")


def _rolled(run: KnownRun, vehicle: Vehicle) -> Rolled | None:
    spectra = roll_spectra_of(run.batches)
    if spectra is None:
        return None
    at_m = cg_left_m(vehicle, run.payload_kg, run.payload_left_m or 0.0)
    std_m = run.payload_left_std_m * run.payload_kg / (vehicle.empty_mass_kg + run.payload_kg)
    return Rolled(spectra.lever_m(*SIGN_BAND_HZ), at_m, std_m, run.payload_kg == 0.0 or run.payload_left_m is not None)


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
