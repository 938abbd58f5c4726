"""The data of the likelihood: spectral matrices of the sensors, grouped by speed and amplitude.

Segments are short, tapered, detrended, and never cross a masked sample. Each is divided by its own power, so that a
rough stretch does not dominate. The road reaches the rear axle later than the front by the wheelbase over the speed;
the phase of that delay is averaged over the speeds within each segment, because averaged spectra contain averaged
phases. The sensors' own noise is read above the frequencies of the vehicle's movement.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.spectrum import frequencies_hz, segment_starts, segment_transforms
from gateway.model.table import INDEX, N
from gateway.records import C128, F64, I64, Batch, Bool, Why

PAIRS: Final = ((1, 0), (2, 0), (2, 1))
"""Pairs (row, column) of sensors: pitch rate and acceleration; roll rate and each of these."""
SPEED_BIN: Final = 0.03  # chosen: width of a group of segments in the logarithm of speed
AMPLITUDE_BIN: Final = 0.5  # chosen: and in the logarithm of amplitude; friction and noise matter more at small ones
SPEED_CHANGE_MAX_MPS2: Final = 0.3  # chosen: braking and accelerating pitch the body without any road
SPEED_SAMPLE_STEP: Final = 8  # chosen: the speed varies little within 0.16 s
LEAST_SEGMENTS: Final = 6  # chosen: a mean of fewer segments scatters too much
LEAST_SHARE_WITH_ROLL: Final = 0.7  # chosen: of the segments; with fewer, using the roll rate loses more than it gains

FLOOR_BAND_HZ: Final = (16.5, 20.0)  # chosen: above the analysed band, within the pass-band of the low-pass
NOISY_FROM: Final = 4.0  # chosen: times the largest expected power, twice the amplitude
NOISY_RATIO: Final = NOISY_FROM**0.5  # the same in amplitude
FLOOR_SEGMENT_N: Final = 256  # chosen: 5 s at 50 Hz

_LEFT, _YAW, _LAG = (INDEX[name] for name in ("sensor_left_m", "gyro_yaw_rad", "gyro_lag_s"))


@dataclass(frozen=True, slots=True)
class Mount:
    """A sensor left_m left of the centre line, its gyro turned to the left about the vertical by yaw_rad, and delayed
    against the accelerometer by gyro_lag_s.

    Such a sensor reads left_m times the roll acceleration in addition to heave, and some roll rate in its pitch rate.
    Both are linear in the three signals, and a rigid body's (axes and signs of ISO 8855, first order in the turn), so
    they are removed from each transform. Roll that is recognised as such does not change the load. The map of the three
    transforms has the determinant 1 + yaw^2, independent of frequency and lever arm: the likelihood of all three is the
    same whether the spectra are moved to the centre line or the model's sensor is moved off it.
    """

    left_m: float
    yaw_rad: float
    gyro_lag_s: float

    def levelled(self, sensed: Sequence[C128], freq_hz: F64) -> tuple[C128, C128, C128]:
        """Transforms (k, m) of acceleration, pitch rate and roll rate, at freq_hz (m,), as on the centre line.

        The rates are square to the vehicle but keep their lag: the half-car has it as a parameter.
        """
        acceleration, pitch_rate, roll_rate = sensed
        turn = 2j * np.pi * freq_hz
        roll_rate, pitch_rate = roll_rate - self.yaw_rad * pitch_rate, pitch_rate + self.yaw_rad * roll_rate
        return acceleration - (self.left_m * turn * np.exp(turn * self.gyro_lag_s)) * roll_rate, pitch_rate, roll_rate


def mount_of(theta: F64) -> Mount | None:
    """The sensor's mount by theta (n,); None without roll parameters."""
    return Mount(float(theta[_LEFT]), float(theta[_YAW]), float(theta[_LAG])) if len(theta) > N else None


def level(theta: F64) -> F64:
    """theta (n,) of the same vehicle with roll, its sensor on the centre line and square to it."""
    placed = theta.copy()
    placed[[_LEFT, _YAW]] = 0.0
    return placed


@dataclass(frozen=True, slots=True)
class Reading:
    """How spectra of a vehicle are computed: band_hz is inclusive, n_segment in samples.

    usual_log_amplitude is the vehicle's amplitude in calibration (log_amplitude_of); None: that of the drive itself.
    usual_stroke_mps is the stroke speed of front and rear springs there; None if friction follows the body's amplitude.
    with_roll: the roll rate is used too, if a drive has enough of it; then all signals are moved to the centre line, if
    mount has the sensor's place.
    """

    wheelbase_m: float
    band_hz: tuple[float, float]
    n_segment: int
    usual_log_amplitude: float | None = None
    with_roll: bool = False
    mount: Mount | None = None
    usual_stroke_mps: tuple[float, float] | None = None

    def with_gyro_late_by(self, lag_s: float) -> "Reading":
        """This reading with another lag of the gyro, if it has a mount."""
        return replace(self, mount=replace(self.mount, gyro_lag_s=lag_s)) if self.mount else self


@dataclass(frozen=True, slots=True)
class CrossSpectra:
    """Mean spectral matrices of b groups of segments at m frequencies, each segment divided by its power.

    freq_hz (m + 2,) has one guard frequency at either end. parts (p^2, b, m) are the auto-spectra of acceleration,
    pitch rate and, if used, roll rate, then the real and the imaginary part of each of PAIRS, the row times the
    conjugate of the column. delay_phase (b, m + 2) is the mean of exp(-j 2 pi f l / v), delay_s (b, 1) the mean of l /
    v and n_segments (b, 1) the number of segments in each group. inverse_power (b, 1) is the mean factor of the
    segments, log_amplitude (b, 1) the amplitude relative to the usual one. The two root mean squares are of the
    segments before division, in m/s2 and rad/s within the band; reading is how they were computed, with the usual
    amplitude filled in. log_strokes (b, 2) is the stroke speed of front and rear springs relative to the usual one;
    None if not computed. noise (p, m) is the power density of the sensors' own noise in excess of calibration; None:
    none.
    """

    freq_hz: F64
    parts: F64
    delay_phase: C128
    delay_s: F64
    n_segments: F64
    inverse_power: F64
    log_amplitude: F64
    acceleration_rms_mps2: float
    pitch_rate_rms_radps: float
    reading: Reading
    log_strokes: F64 | None = None
    noise: F64 | None = None

    @property
    def n_sensors(self) -> int:
        """Three with a roll rate, else two."""
        return 2 if len(self.parts) == 4 else 3

    @property
    def has_roll(self) -> bool:
        """Whether the roll rate is one of the sensors."""
        return self.n_sensors == 3

    @property
    def acceleration(self) -> F64:
        """(b, m) auto-spectrum."""
        return np.asarray(self.parts[0])

    @property
    def pitch_rate(self) -> F64:
        """(b, m) auto-spectrum."""
        return np.asarray(self.parts[1])

    @property
    def cross(self) -> C128:
        """(b, m) pitch rate times the conjugate of acceleration."""
        return np.asarray(self.parts[self.n_sensors] + 1j * self.parts[self.n_sensors + 1])

    @property
    def log_movement(self) -> F64:
        """(b, 2) logarithm of front and rear axle's movement relative to the usual; that of the body if the strokes are
        unknown.
        """
        return np.repeat(self.log_amplitude, 2, axis=1) if self.log_strokes is None else self.log_strokes

    @property
    def without_roll(self) -> "CrossSpectra":
        """These spectra with acceleration and pitch rate alone."""
        if not self.has_roll:
            return self
        return replace(self, parts=self.parts[[0, 1, 3, 4]], noise=None if self.noise is None else self.noise[:2])

    def within(self, band_hz: tuple[float, float]) -> "CrossSpectra":
        """These spectra at fewer frequencies; the guard frequencies are just outside the band."""
        kept = np.flatnonzero((self.freq_hz[1:-1] >= band_hz[0]) & (self.freq_hz[1:-1] <= band_hz[1]))
        inner, guarded = slice(kept[0], kept[-1] + 1), slice(kept[0], kept[-1] + 3)
        return replace(
            self,
            freq_hz=self.freq_hz[guarded],
            delay_phase=self.delay_phase[:, guarded],
            parts=self.parts[..., inner],
            noise=None if self.noise is None else self.noise[:, inner],
        )

    def showing(self, parts: F64) -> "CrossSpectra":
        """This drive with other spectra (p^2, b, m)."""
        return replace(self, parts=parts)

    def with_sensors_times(self, *gains: float) -> "CrossSpectra":
        """The spectra with each sensor's gain multiplied, -1 for a reversed one; the division of segments stays."""
        auto = [gain**2 for gain in gains]
        pairs = [gains[i] * gains[j] for i, j in PAIRS[: self.n_sensors * (self.n_sensors - 1) // 2]]
        return self.showing(self.parts * np.r_[auto, np.repeat(pairs, 2)][:, None, None])

    def with_acceleration_times(self, gain: float) -> "CrossSpectra":
        """The spectra with the accelerometer's gain multiplied."""
        return self.with_sensors_times(gain, *[1.0] * (self.n_sensors - 1))

    def with_pitch_reversed(self) -> "CrossSpectra":
        """The spectra with the other sign of the pitch rate."""
        return self.with_sensors_times(1.0, -1.0, *[1.0] * (self.n_sensors - 2))

    @property
    def log_amplitude_mean(self) -> float:
        """Mean amplitude relative to the usual, over all segments (logarithm)."""
        return float(np.average(self.log_amplitude, weights=self.n_segments))

    @property
    def n_total(self) -> int:
        """Number of all segments."""
        return int(self.n_segments.sum())

    @property
    def coherence(self) -> F64:
        """(m,) coherence of the first two sensors over all segments, 0..1."""
        cross, a, g = (
            np.sum(self.n_segments * one, axis=0) for one in (self.cross, self.acceleration, self.pitch_rate)
        )
        return np.asarray(np.abs(cross) ** 2 / (a * g))

    @property
    def delay_mean_s(self) -> float:
        """Mean delay from axle to axle over all segments."""
        return float(np.average(self.delay_s, weights=self.n_segments))

    @property
    def delay_std_s(self) -> float:
        """Standard deviation of that delay."""
        return float(np.sqrt(np.average((self.delay_s - self.delay_mean_s) ** 2, weights=self.n_segments)))


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
    """Spectra of all usable segments of ``batches``, which share one rate; None if fewer than six.

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
    parts = [
        [
            segment_transforms(x, starts, reading.n_segment, batch.rate_hz)[:, kept]
            for x in _sensed(batch, with_roll=with_roll)
        ]
        for batch, starts in zip(batches, chosen, strict=True)
    ]
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


def grouped(segments: Segments, reading: Reading) -> CrossSpectra:
    """The spectra of these segments, on the centre line if ``reading`` has the sensor's mount."""
    freq_hz = segments.freq_hz
    sensed: Sequence[C128] = [one[:, 1:-1] for one in segments.sensed]
    if len(sensed) > 2 and reading.mount is not None:
        sensed = reading.mount.levelled(sensed, freq_hz[1:-1])
    auto = [one.real**2 + one.imag**2 for one in sensed]
    crosses = [sensed[i] * np.conj(sensed[j]) for i, j in PAIRS[: len(sensed) * (len(sensed) - 1) // 2]]
    parts = np.array([*auto, *(part for one in crosses for part in (one.real, one.imag))])
    power_a, power_g = auto[0].mean(axis=1), auto[1].mean(axis=1)
    inverse_power = 1.0 / np.maximum(np.sqrt(power_a * power_g), np.finfo(float).tiny)
    amplitude = log_amplitude_of(auto[0], auto[1])
    usual = float(amplitude.mean()) if reading.usual_log_amplitude is None else reading.usual_log_amplitude
    log_amplitude = amplitude - usual
    alike = np.round(np.stack([np.log(segments.delay_s) / SPEED_BIN, log_amplitude / AMPLITUDE_BIN], axis=1))
    _, member = np.unique(alike, axis=0, return_inverse=True)
    n_segments = np.bincount(member).astype(float)[:, None]
    is_in = (member == np.arange(len(n_segments))[:, None]) / n_segments
    width_hz = float(freq_hz[-2] - freq_hz[1])
    return CrossSpectra(
        freq_hz=freq_hz,
        parts=is_in @ (parts * inverse_power[:, None]),
        delay_phase=is_in @ segments.delay_phase,
        delay_s=is_in @ segments.delay_s[:, None],
        n_segments=n_segments,
        inverse_power=is_in @ inverse_power[:, None],
        log_amplitude=is_in @ log_amplitude[:, None],
        acceleration_rms_mps2=float(np.sqrt(power_a.mean() * width_hz)),
        pitch_rate_rms_radps=float(np.sqrt(power_g.mean() * width_hz)),
        reading=replace(reading, usual_log_amplitude=usual),
    )


def log_amplitude_of(acceleration: F64, pitch_rate: F64) -> F64:
    """Amplitude of a vehicle's movement (...), from the power of both sensors at each frequency (..., m).

    The natural logarithm of an amplitude, averaged over frequencies and sensors. Averaged powers would be biased: a
    segment whose peak is higher by chance would look like one with more movement.
    """
    tiny = np.finfo(float).tiny
    logs = np.log(np.maximum(acceleration, tiny)) + np.log(np.maximum(pitch_rate, tiny))
    return np.asarray(0.25 * logs.mean(axis=-1))


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


def _n(starts: Sequence[I64]) -> int:
    return sum(len(one) for one in starts)


def _mean_phase(delays_s: F64, weight: F64, freq_hz: F64) -> C128:
    """(k, m) mean of exp(-j 2 pi f delay) over delays_s (k, t), by weight (t,), at evenly spaced freq_hz (m,)."""
    turned = np.exp(-2j * np.pi * freq_hz[0] * delays_s)
    step = np.exp(-2j * np.pi * (freq_hz[1] - freq_hz[0]) * delays_s)
    found = np.empty((len(delays_s), len(freq_hz)), np.complex128)
    for column in range(len(freq_hz)):
        found[:, column] = turned @ weight
        turned *= step
    return found


UsualFloor = tuple[tuple[float, float], ...]
"""For each sensor, the quietest and the loudest batch of a calibration."""


def floor_of(batch: Batch) -> F64:
    """(p,) noise of each sensor, in the square of its unit per hertz; NaN if no segment fits between the gaps.

    Springs, wheels and tyres move little between 16.5 and 20 Hz, so the noise of a sensor shows there. The median over
    segments and frequencies, divided by log 2 (an exponential distribution): tones of engine and wheels, and potholes,
    are few and do not move it.
    """
    freq_hz = frequencies_hz(FLOOR_SEGMENT_N, batch.rate_hz)
    kept = (freq_hz >= FLOOR_BAND_HZ[0]) & (freq_hz <= FLOOR_BAND_HZ[1])

    def floor(x: F64) -> float:
        starts = segment_starts(batch.usable & np.isfinite(x), FLOOR_SEGMENT_N, FLOOR_SEGMENT_N)
        if not len(starts):
            return float("nan")
        transforms = segment_transforms(x, starts, FLOOR_SEGMENT_N, batch.rate_hz)[:, kept]
        return float(np.median(np.abs(transforms) ** 2) / np.log(2.0))

    return np.array([floor(one) for one in _sensed(batch, with_roll=True)])


def usual_floor(batches: Iterable[Batch], *, with_roll: bool) -> UsualFloor | None:
    """The floor of a calibration's batches; None if unknown. The roll rate is left out if it is not used."""
    floors = [floor_of(batch) for batch in batches]
    n_sensors = min((3 if with_roll else 2, *(len(one) for one in floors))) if floors else 0
    by_sensor = np.array([one[:n_sensors] for one in floors]).T
    if not n_sensors or not np.isfinite(by_sensor).any(axis=1).all():
        return None
    quietest, loudest = np.nanmin(by_sensor, axis=1), np.nanmax(by_sensor, axis=1)
    return tuple(zip(quietest.tolist(), loudest.tolist(), strict=True)) if np.all(quietest > 0.0) else None


def expected_floor(usual: UsualFloor, times: float) -> F64:
    """(p,) largest expected floor of an untouched sensor when the vehicle moves with ``times`` the power of
    calibration: the sensor's own noise is constant, and the vehicle's vibration grows with the power.
    """
    quietest, loudest = np.array(usual).T
    return np.asarray(quietest + (loudest - quietest) * max(1.0, times))


def noise_over(floor: F64, expected: F64) -> F64:
    """(p,) excess of each sensor over the expected floor; 0 if it may still be vibration.

    Vibration of the drive train shows too: a floor counts as noise only far above everything that calibration saw.
    """
    n = min(len(floor), len(expected))
    over = np.where(floor[:n] > NOISY_FROM * expected[:n], floor[:n] - expected[:n], 0.0)
    return np.pad(over, (0, len(floor) - n))


def as_read(noise: F64, reading: Reading, freq_hz: F64, *, with_roll: bool) -> F64:
    """The sensors' noise densities (p,) as the spectra at freq_hz (m,) contain them, shaped (p, m).

    Moving a sensor to the centre line adds the roll rate's noise to the acceleration, times lever arm and frequency,
    and some of it to the pitch rate.
    """
    found = np.repeat(noise[: 3 if with_roll else 2, None], len(freq_hz), axis=1)
    if with_roll and reading.mount is not None:
        found[0] += noise[2] * (2.0 * np.pi * freq_hz * reading.mount.left_m) ** 2
        found[1] += noise[2] * reading.mount.yaw_rad**2
    return found
