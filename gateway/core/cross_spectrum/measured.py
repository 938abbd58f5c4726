"""The data of the likelihood: cross-spectra of the sensors, grouped by speed and amplitude.

Segments are short, tapered, detrended, and never cross a masked sample. Each is divided by its own power, so that a
rough stretch does not dominate. The road reaches the rear axle later than the front by the wheelbase over the speed;
the phase of that delay is averaged over the speeds within each segment, because averaged spectra contain averaged
phases.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gateway.core.cross_spectrum.model.matrix import SpectralMatrix
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.spectrum import frequencies_hz, segment_starts, segment_transforms
from gateway.records import C128, F64, I64, Batch, Bool, Why

SPEED_BIN = 0.03  # chosen: width of a group of segments in the logarithm of speed
AMPLITUDE_BIN = 0.5  # chosen: and in the logarithm of amplitude; friction and noise matter more at small ones
SPEED_CHANGE_MAX_MPS2 = 0.3  # chosen: braking and accelerating pitch the body without any road
SPEED_SAMPLE_STEP = 8  # chosen: the speed varies little within 0.16 s
LEAST_SEGMENTS = 6  # chosen: a mean of fewer segments scatters too much
LEAST_SHARE_WITH_ROLL = 0.7  # chosen: of the segments; with fewer, using the roll rate loses more than it gains


@dataclass(frozen=True, slots=True)
class RollSpectra:
    """The roll rate's part of cross-spectra (b, m): its auto-spectrum, and its product with the conjugates of the
    others.
    """

    roll_rate: F64
    with_acceleration: C128
    with_pitch_rate: C128

    def times(self, acceleration: float, pitch_rate: float) -> "RollSpectra":
        """The spectra with the gains of the two other sensors multiplied by these factors."""
        return RollSpectra(self.roll_rate, acceleration * self.with_acceleration, pitch_rate * self.with_pitch_rate)


@dataclass(frozen=True, slots=True)
class CrossSpectra:
    """Mean spectral matrices of b groups of segments at m frequencies, each segment divided by its power.

    freq_hz (m + 2,) has one guard frequency at either end; acceleration, pitch_rate (b, m) are auto-spectra, cross (b,
    m) is pitch rate times the conjugate of acceleration; delay_phase (b, m + 2) is the mean of exp(-j 2 pi f l / v),
    delay_s (b, 1) the mean of l / v and n_segments (b, 1) the number of segments in each group. inverse_power (b, 1) is
    the mean factor of the segments, log_amplitude (b, 1) the amplitude relative to the usual one. The two root mean
    squares are of the segments before division, in m/s2 and rad/s within the band; reading is how they were computed,
    with the usual amplitude filled in. roll is None without a roll rate. log_strokes (b, 2) is the stroke speed of
    front and rear springs relative to the usual one (model.strokes); None if not computed. noise (p, m) is the power
    density of the sensors' own noise in excess of calibration (cross_spectrum.floor); None: none.
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
    roll: RollSpectra | None = None
    log_strokes: F64 | None = None
    noise: F64 | None = None

    @property
    def log_movement(self) -> F64:
        """(b, 2) logarithm of front and rear axle's movement relative to the usual; that of the body if the strokes are
        unknown.
        """
        return np.repeat(self.log_amplitude, 2, axis=1) if self.log_strokes is None else self.log_strokes

    @property
    def n_sensors(self) -> int:
        """Three with a roll rate, else two."""
        return 2 if self.roll is None else 3

    @property
    def matrix(self) -> SpectralMatrix:
        """The spectral matrix of all sensors, (p, b, m)."""
        if self.roll is None:
            return SpectralMatrix(np.stack([self.acceleration, self.pitch_rate]), self.cross[None])
        return SpectralMatrix(
            np.stack([self.acceleration, self.pitch_rate, self.roll.roll_rate]),
            np.stack([self.cross, self.roll.with_acceleration, self.roll.with_pitch_rate]),
        )

    @property
    def without_roll(self) -> "CrossSpectra":
        """Acceleration and pitch rate alone."""
        return replace(self, roll=None, noise=None if self.noise is None else self.noise[:2])

    def within(self, band_hz: tuple[float, float]) -> "CrossSpectra":
        """The same at fewer frequencies; the guard frequencies are just outside the band."""
        kept = np.flatnonzero((self.freq_hz[1:-1] >= band_hz[0]) & (self.freq_hz[1:-1] <= band_hz[1]))
        inner, guarded = slice(kept[0], kept[-1] + 1), slice(kept[0], kept[-1] + 3)
        matrix = SpectralMatrix(self.matrix.auto[..., inner], self.matrix.cross[..., inner])
        noise = None if self.noise is None else self.noise[:, inner]
        fewer = replace(self, freq_hz=self.freq_hz[guarded], delay_phase=self.delay_phase[:, guarded], noise=noise)
        return fewer.showing(matrix)

    def showing(self, matrix: SpectralMatrix) -> "CrossSpectra":
        """The same drive with these spectra (p, b, m), of as many sensors."""
        auto, cross = matrix.auto, matrix.cross
        roll = RollSpectra(auto[2], cross[1], cross[2]) if len(auto) > 2 else None
        return replace(self, acceleration=auto[0], pitch_rate=auto[1], cross=cross[0], roll=roll)

    @property
    def log_amplitude_mean(self) -> float:
        """Mean amplitude relative to the usual, over all segments (logarithm)."""
        return float(np.sum(self.log_amplitude * self.n_segments) / self.n_segments.sum())

    @property
    def n_total(self) -> int:
        """Number of all segments."""
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
        """Mean delay from axle to axle over all segments."""
        return float(np.average(self.delay_s, weights=self.n_segments))

    @property
    def delay_std_s(self) -> float:
        """Standard deviation of that delay."""
        return float(np.sqrt(np.average((self.delay_s - self.delay_mean_s) ** 2, weights=self.n_segments)))

    def with_acceleration_times(self, gain: float) -> "CrossSpectra":
        """The spectra with the accelerometer's gain multiplied; the division of segments stays."""
        roll = self.roll and self.roll.times(gain, 1.0)
        return replace(self, acceleration=gain**2 * self.acceleration, cross=gain * self.cross, roll=roll)

    def with_pitch_reversed(self) -> "CrossSpectra":
        """The spectra with the other sign of the pitch rate."""
        return replace(self, cross=-self.cross, roll=self.roll and self.roll.times(1.0, -1.0))


@dataclass(frozen=True, slots=True)
class Segments:
    """k segments: their transforms (k, m + 2) at freq_hz (m + 2,) by sensor, as measured; their mean wheelbase delays
    (k,), and the mean phases of these delays (k, m + 2).
    """

    freq_hz: F64
    sensed: tuple[C128, ...]
    delay_s: F64
    delay_phase: C128


def cross_spectra_of(batches: Iterable[Batch], reading: Reading) -> CrossSpectra | None:
    """Cross-spectra of all usable segments of ``batches``, which share one rate; None if fewer than six.

    If the roll rate is requested and most segments lack it, it is left out.
    """
    segments = segments_of(batches, reading)
    return None if segments is None else grouped(segments, reading)


def segments_of(batches: Iterable[Batch], reading: Reading) -> Segments | None:
    """The segments of cross_spectra_of. They do not depend on the sensor's mount and on what is usual."""
    batches = tuple(batches)
    chosen = [_steady_starts(batch, reading, with_roll=False) for batch in batches]
    with_roll = reading.with_roll and all(batch.roll_rate_radps is not None for batch in batches)
    if with_roll:
        rolling = [_steady_starts(batch, reading, with_roll=True) for batch in batches]
        with_roll = _n(rolling) >= max(LEAST_SEGMENTS, LEAST_SHARE_WITH_ROLL * _n(chosen))
        chosen = rolling if with_roll else chosen
    if _n(chosen) < LEAST_SEGMENTS:
        return None
    every_hz = frequencies_hz(reading.n_segment, batches[0].rate_hz)
    low_hz, high_hz = reading.band_hz
    kept = np.flatnonzero((every_hz >= low_hz - every_hz[1]) & (every_hz <= high_hz + every_hz[1]))
    parts = [_sensed_in(*pair, kept, reading, with_roll=with_roll) for pair in zip(batches, chosen, strict=True)]
    sampled = np.arange(0, reading.n_segment, SPEED_SAMPLE_STEP)
    speeds_mps = [one.speed_mps[starts[:, None] + sampled] for one, starts in zip(batches, chosen, strict=True)]
    delays_s = reading.wheelbase_m / np.concatenate(speeds_mps)
    weight = np.hanning(reading.n_segment + 1)[:-1:SPEED_SAMPLE_STEP] ** 2
    weight = weight / weight.sum()
    return Segments(
        freq_hz=every_hz[kept],
        sensed=tuple(np.concatenate(of_one) for of_one in zip(*parts, strict=True)),
        delay_s=delays_s @ weight,
        delay_phase=_mean_phase(delays_s, weight, every_hz[kept]),
    )


def _n(starts: Sequence[I64]) -> int:
    return sum(len(one) for one in starts)


def why_no_spectra(batch: Batch, reading: Reading) -> Why:
    """Why :func:`cross_spectra_of` returns None for a batch: too little time, unbroken stretches, sensor data or steady
    speed.

    Unbroken stretches are missing because of the cause that masked most of the batch.
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
    """Amplitude of a vehicle's movement (...), from the power of both sensors at each frequency (..., m).

    The natural logarithm of an amplitude, averaged over frequencies and sensors. Averaged powers would be biased: a
    segment whose peak is higher by chance would look like one with more movement.
    """
    tiny = np.finfo(float).tiny
    found: F64 = 0.25 * np.mean(np.log(np.maximum(acceleration, tiny)) + np.log(np.maximum(pitch_rate, tiny)), axis=-1)
    return found


def _sensed(batch: Batch, *, with_roll: bool) -> list[F64]:
    sensed = [batch.vertical_acceleration_mps2, batch.pitch_rate_radps]
    return [*sensed, batch.roll_rate_radps] if with_roll and batch.roll_rate_radps is not None else sensed


def _steady_starts(batch: Batch, reading: Reading, *, with_roll: bool) -> I64:
    """First samples (k,) of segments in which all sensors read and the speed is steady."""
    n_segment = reading.n_segment
    has_all = np.logical_and.reduce([np.isfinite(one) for one in _sensed(batch, with_roll=with_roll)])
    starts = segment_starts(batch.usable & has_all, n_segment, n_segment // 2)
    if not starts.size:
        return starts
    speeds_mps = np.lib.stride_tricks.sliding_window_view(batch.speed_mps, n_segment)[starts]
    steady: I64 = starts[np.ptp(speeds_mps, axis=1) < SPEED_CHANGE_MAX_MPS2 * n_segment / batch.rate_hz]
    return steady


def _sensed_in(batch: Batch, starts: I64, kept: I64, reading: Reading, *, with_roll: bool) -> list[C128]:
    """Transforms (k, m + 2) by sensor of the segments that begin at ``starts`` (k,), at the frequencies ``kept``."""
    return [
        segment_transforms(one, starts, reading.n_segment, batch.rate_hz)[:, kept]
        for one in _sensed(batch, with_roll=with_roll)
    ]


def grouped(segments: Segments, reading: Reading) -> CrossSpectra:
    """The cross-spectra of these segments, on the centre line if ``reading`` has the sensor's mount."""
    freq_hz, mean_delay_s = segments.freq_hz, segments.delay_s
    sensed: Sequence[C128] = [one[:, 1:-1] for one in segments.sensed]
    if len(sensed) > 2 and reading.mount is not None:
        a, g, roll = sensed
        sensed = reading.mount.levelled((a, g, roll), freq_hz[1:-1])
    a, g, *rolling = sensed
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
    is_in = (member == np.arange(len(n_segments))[:, None]) / n_segments

    def mean(per_segment: C128 | F64) -> C128:
        return np.asarray(is_in @ per_segment, np.complex128)

    def with_roll(roll: C128) -> RollSpectra:
        return RollSpectra(
            roll_rate=np.real(mean(np.abs(roll) ** 2 / divisor)),
            with_acceleration=mean(roll * np.conj(a) / divisor),
            with_pitch_rate=mean(roll * np.conj(g) / divisor),
        )

    return CrossSpectra(
        freq_hz=freq_hz,
        acceleration=np.real(mean(np.abs(a) ** 2 / divisor)),
        pitch_rate=np.real(mean(np.abs(g) ** 2 / divisor)),
        cross=mean(g * np.conj(a) / divisor),
        delay_phase=mean(segments.delay_phase),
        delay_s=np.real(mean(mean_delay_s[:, None])),
        n_segments=n_segments,
        inverse_power=np.real(mean(1.0 / divisor)),
        log_amplitude=np.real(mean(log_amplitude[:, None])),
        acceleration_rms_mps2=rms_a,
        pitch_rate_rms_radps=rms_g,
        reading=replace(reading, usual_log_amplitude=usual),
        roll=with_roll(rolling[0]) if rolling else None,
    )


def _mean_phase(delays_s: F64, weight: F64, freq_hz: F64) -> C128:
    """(k, m) mean of exp(-j 2 pi f delay) over delays_s (k, t), by weight (t,), at evenly spaced freq_hz (m,)."""
    turned = np.exp(-2j * np.pi * freq_hz[0] * delays_s)
    step = np.exp(-2j * np.pi * (freq_hz[1] - freq_hz[0]) * delays_s)
    found = np.empty((len(delays_s), len(freq_hz)), np.complex128)
    for column in range(len(freq_hz)):
        found[:, column] = turned @ weight
        turned *= step
    return found
