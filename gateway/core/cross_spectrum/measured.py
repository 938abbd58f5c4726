"""What the likelihood needs of a drive: cross-spectra of the two sensors, grouped by speed and amplitude.

Segments are short, tapered, detrended, and never cross a masked sample. Each is divided by its own
power, so that a rough stretch does not drown the others. The road reaches the rear axle later than
the front by the wheelbase over the speed; the phase of that delay is averaged over the speeds driven
inside each segment, because averaged spectra hold averaged phases.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from gateway.core.spectrum import frequencies_hz, segment_starts, segment_transforms
from gateway.records import C128, F64, I64, Batch, Bool, Why

SPEED_BIN = 0.03  # width of a group of segments in the logarithm of speed
AMPLITUDE_BIN = 0.5  # and in the logarithm of how much it moves: friction and noise count for more where that is little
SPEED_CHANGE_MAX_MPS2 = 0.3  # braking and pulling away pitch the body without any road
SPEED_SAMPLE_STEP = 8
LEAST_SEGMENTS = 6


@dataclass(frozen=True, slots=True)
class Reading:
    """How spectra are taken of a vehicle: band_hz is inclusive, n_segment in samples.

    usual_log_amplitude is how much the vehicle moved in calibration (:func:`log_amplitude_of`); None for as much as in
    the drive that is read.
    """

    wheelbase_m: float
    band_hz: tuple[float, float]
    n_segment: int
    usual_log_amplitude: float | None = None


@dataclass(frozen=True, slots=True)
class CrossSpectra:
    """Mean spectral matrices of b groups of segments at m frequencies, each segment divided by its power.

    freq_hz (m + 2,) has one guard frequency at either end; acceleration, pitch_rate (b, m) are
    auto-spectra, cross (b, m) is pitch rate times the conjugate of acceleration; delay_phase
    (b, m + 2) is the mean of exp(-j 2 pi f l / v), delay_s (b, 1) the mean of l / v and n_segments
    (b, 1) the number of segments in each group. inverse_power (b, 1) is the mean of what segments were
    multiplied by, log_amplitude (b, 1) how much they moved over the usual. The two root mean squares are of
    the segments before division, in m/s2 and rad/s within the band; reading is how they were taken, the usual
    amplitude filled in.
    """

    freq_hz: F64
    acceleration: F64
    pitch_rate: F64
    cross: C128
    delay_phase: C128
    delay_s: F64
    n_segments: F64
    inverse_power: F64
    log_amplitude: F64
    acceleration_rms_mps2: float
    pitch_rate_rms_radps: float
    reading: Reading

    @property
    def log_amplitude_mean(self) -> float:
        """How much the vehicle moved over the usual, over all segments."""
        return float(np.sum(self.log_amplitude * self.n_segments) / self.n_segments.sum())

    @property
    def n_total(self) -> int:
        """Segments in all."""
        return int(self.n_segments.sum())

    @property
    def coherence(self) -> F64:
        """(m,) coherence of the two sensors over all segments, 0..1."""
        cross = np.abs(np.sum(self.n_segments * self.cross, axis=0)) ** 2
        auto = np.sum(self.n_segments * self.acceleration, axis=0) * np.sum(self.n_segments * self.pitch_rate, axis=0)
        coherence: F64 = cross / auto
        return coherence

    @property
    def delay_mean_s(self) -> float:
        """Mean time from axle to axle over all segments."""
        return float(np.average(self.delay_s, weights=self.n_segments))

    @property
    def delay_std_s(self) -> float:
        """How much that time varied."""
        return float(np.sqrt(np.average((self.delay_s - self.delay_mean_s) ** 2, weights=self.n_segments)))

    def with_acceleration_times(self, gain: float) -> "CrossSpectra":
        """As if the accelerometer had so many times its gain; the division of segments stays."""
        return replace(self, acceleration=gain**2 * self.acceleration, cross=gain * self.cross)

    def with_pitch_reversed(self) -> "CrossSpectra":
        """As if the pitch rate had the other sign."""
        return replace(self, cross=-self.cross)


@dataclass(frozen=True, slots=True)
class _Segments:
    """Transforms (k, m + 2) of k segments and their wheelbase delays (k, t)."""

    acceleration: C128
    pitch_rate: C128
    delays_s: F64


def cross_spectra_of(batches: Iterable[Batch], reading: Reading) -> CrossSpectra | None:
    """Cross-spectra of all usable segments of ``batches``, which share one rate; None if fewer than six."""
    parts: list[_Segments] = []
    freq_hz = np.empty(0)
    for batch in batches:
        every_hz = frequencies_hz(reading.n_segment, batch.rate_hz)
        step_hz = every_hz[1]
        kept = np.flatnonzero((every_hz >= reading.band_hz[0] - step_hz) & (every_hz <= reading.band_hz[1] + step_hz))
        freq_hz = every_hz[kept]
        parts.append(_segments(batch, reading, kept))
    if sum(len(part.delays_s) for part in parts) < LEAST_SEGMENTS:
        return None
    joined = _Segments(
        np.concatenate([p.acceleration for p in parts]),
        np.concatenate([p.pitch_rate for p in parts]),
        np.concatenate([p.delays_s for p in parts]),
    )
    return _grouped(joined, freq_hz, reading)


def why_no_spectra(batch: Batch, reading: Reading) -> Why:
    """What a batch lacks of which :func:`cross_spectra_of` makes nothing: time, unbroken stretches, a sensor, or rest.

    Stretches are broken by whatever masked most of the batch.
    """

    def is_enough(mask: Bool) -> bool:
        return len(segment_starts(mask, reading.n_segment, reading.n_segment // 2)) >= LEAST_SEGMENTS

    if np.count_nonzero(batch.usable) <= 4 * reading.n_segment:
        return Why.TOO_SHORT
    if not is_enough(batch.usable):
        return max(batch.shares, key=lambda why: batch.shares[why], default=Why.GAP)
    if not is_enough(batch.usable & np.isfinite(batch.vertical_acceleration_mps2)):
        return Why.ACCELERATION_MISSING
    if not is_enough(batch.usable & np.isfinite(batch.pitch_rate_radps)):
        return Why.PITCH_RATE_MISSING
    return Why.SPEED_SPREAD


def log_amplitude_of(acceleration: F64, pitch_rate: F64) -> F64:
    """How much a vehicle moves (...), from the power of both sensors at each frequency (..., m).

    The natural logarithm of an amplitude, averaged over frequencies and sensors. Averaged powers would not do: by
    chance a segment's peak is higher, and would look like a peak that is higher wherever more moves.
    """
    tiny = np.finfo(float).tiny
    found: F64 = 0.25 * np.mean(np.log(np.maximum(acceleration, tiny)) + np.log(np.maximum(pitch_rate, tiny)), axis=-1)
    return found


def _segments(batch: Batch, reading: Reading, kept: I64) -> _Segments:
    n_segment = reading.n_segment
    has_both = np.isfinite(batch.vertical_acceleration_mps2) & np.isfinite(batch.pitch_rate_radps)
    starts = segment_starts(batch.usable & has_both, n_segment, n_segment // 2)
    if starts.size:
        speeds_mps = np.lib.stride_tricks.sliding_window_view(batch.speed_mps, n_segment)[starts]
        is_steady = np.ptp(speeds_mps, axis=1) < SPEED_CHANGE_MAX_MPS2 * n_segment / batch.rate_hz
        starts, speeds_mps = starts[is_steady], speeds_mps[is_steady]
    if not starts.size:
        nothing = np.empty((0, len(kept)), np.complex128)
        return _Segments(nothing, nothing, np.empty((0, len(range(0, n_segment, SPEED_SAMPLE_STEP)))))
    return _Segments(
        segment_transforms(batch.vertical_acceleration_mps2, starts, n_segment, batch.rate_hz)[:, kept],
        segment_transforms(batch.pitch_rate_radps, starts, n_segment, batch.rate_hz)[:, kept],
        reading.wheelbase_m / speeds_mps[:, ::SPEED_SAMPLE_STEP],
    )


def _grouped(segments: _Segments, freq_hz: F64, reading: Reading) -> CrossSpectra:
    weight = np.hanning(reading.n_segment + 1)[:-1:SPEED_SAMPLE_STEP] ** 2
    weight = weight / weight.sum()
    mean_delay_s = segments.delays_s @ weight
    a, g = segments.acceleration[:, 1:-1], segments.pitch_rate[:, 1:-1]
    power_a, power_g = np.mean(np.abs(a) ** 2, axis=1), np.mean(np.abs(g) ** 2, axis=1)
    divisor = np.maximum(np.sqrt(power_a * power_g), np.finfo(float).tiny)[:, None]
    width_hz = float(freq_hz[-2] - freq_hz[1])
    rms_a, rms_g = float(np.sqrt(power_a.mean() * width_hz)), float(np.sqrt(power_g.mean() * width_hz))
    amplitude = log_amplitude_of(np.abs(a) ** 2, np.abs(g) ** 2)
    usual = float(amplitude.mean()) if reading.usual_log_amplitude is None else reading.usual_log_amplitude
    log_amplitude = amplitude - usual
    alike = np.round(np.stack([np.log(mean_delay_s) / SPEED_BIN, log_amplitude / AMPLITUDE_BIN], axis=1))
    _, member = np.unique(alike, axis=0, return_inverse=True)
    n_segments = np.bincount(member).astype(float)[:, None]

    def mean(per_segment: C128 | F64) -> C128:
        total = np.zeros((len(n_segments), per_segment.shape[1]), np.complex128)
        np.add.at(total, member, per_segment)
        total /= n_segments
        return total

    phase = np.exp(-2j * np.pi * segments.delays_s[:, :, None] * freq_hz)
    return CrossSpectra(
        freq_hz=freq_hz,
        acceleration=np.real(mean(np.abs(a) ** 2 / divisor)),
        pitch_rate=np.real(mean(np.abs(g) ** 2 / divisor)),
        cross=mean(g * np.conj(a) / divisor),
        delay_phase=mean(np.einsum("t,ktf->kf", weight, phase)),
        delay_s=np.real(mean(mean_delay_s[:, None])),
        n_segments=n_segments,
        inverse_power=np.real(mean(1.0 / divisor)),
        log_amplitude=np.real(mean(log_amplitude[:, None])),
        acceleration_rms_mps2=rms_a,
        pitch_rate_rms_radps=rms_g,
        reading=replace(reading, usual_log_amplitude=usual),
    )
