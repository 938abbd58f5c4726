"""Spectra of masked signals: tapered segments that never cross a sample outside the mask."""

import math
from typing import Final

import numpy as np

from gateway.records import C128, F64, I64, Batch, Bool, Spectra

BAND_HZ: Final = (1.0, 15.0)  # chosen: of the roughness, body and wheel resonances
REFERENCE_SPEED_MPS: Final = 80.0 / 3.6  # chosen: speed that the roughness refers to

DISPLAY_SEGMENT_N = 256  # chosen: 0.2 Hz at 50 Hz
DISPLAY_BAND_HZ = (0.5, 15.0)  # chosen: around the bands of the estimators


def runs_of(mask: Bool) -> I64:
    """Begin and end (k, 2) of every unbroken run of True in ``mask`` (n,); the end is the first index after it."""
    return np.flatnonzero(np.diff(np.r_[False, mask, False].astype(np.int8))).reshape(-1, 2)


def longest_run(mask: Bool) -> int:
    """Length of the longest unbroken run of True, in samples; 0 if there is none."""
    return int(np.max(np.diff(runs_of(mask)), initial=0))


def segment_starts(usable: Bool, n_segment: int, n_step: int) -> I64:
    """First samples (k,) of the segments of ``n_segment`` samples that are entirely usable.

    Within each unbroken run of ``usable`` (n,) a segment begins every ``n_step`` samples.
    """
    runs = [np.arange(begin, end - n_segment + 1, n_step) for begin, end in runs_of(usable).tolist()]
    return np.concatenate([*runs, np.empty(0, np.int64)]).astype(np.int64)


def segment_transforms(x: F64, starts: I64, n_segment: int, rate_hz: float) -> C128:
    """Hann-tapered, linearly detrended Fourier transforms (k, m) of the segments of x (n,) in unit u.

    Scaled so that the mean of |X|^2 over segments is the one-sided power spectral density in u^2/Hz
    (Welch 1967): summed over frequencies times their spacing it is the variance (Parseval). m is
    n_segment // 2 + 1; frequencies come from :func:`frequencies_hz`.
    """
    segments = x[starts[:, None] + np.arange(n_segment)]
    taper = np.hanning(n_segment + 1)[:-1]
    transforms = np.fft.rfft(_detrended(segments) * taper, axis=1)
    one_sided = np.full(transforms.shape[1], 2.0)
    one_sided[0] = 1.0
    if n_segment % 2 == 0:
        one_sided[-1] = 1.0
    scaled: C128 = transforms * np.sqrt(one_sided / (rate_hz * np.sum(taper**2)))
    return scaled


def frequencies_hz(n_segment: int, rate_hz: float) -> F64:
    """(n_segment // 2 + 1,) from 0 to half the rate."""
    return np.arange(n_segment // 2 + 1, dtype=float) * (rate_hz / n_segment)


def _detrended(segments: F64) -> F64:
    """Subtracts from each row its least-squares straight line."""
    n = segments.shape[1]
    ramp = np.linspace(-1.0, 1.0, n)
    slope = segments @ ramp / np.sum(ramp**2)
    lines: F64 = segments.mean(axis=1, keepdims=True) + slope[:, None] * ramp
    return segments - lines


def spectra_of(batch: Batch) -> Spectra | None:
    """Auto- and cross-spectra of a batch for display; None if no segment fits between the gaps."""
    has_both = np.isfinite(batch.vertical_acceleration_mps2) & np.isfinite(batch.pitch_rate_radps)
    starts = segment_starts(batch.usable & has_both, DISPLAY_SEGMENT_N, DISPLAY_SEGMENT_N // 2)
    if not starts.size:
        return None
    a = segment_transforms(batch.vertical_acceleration_mps2, starts, DISPLAY_SEGMENT_N, batch.rate_hz)
    g = segment_transforms(batch.pitch_rate_radps, starts, DISPLAY_SEGMENT_N, batch.rate_hz)
    s_aa, s_gg = np.mean(np.abs(a) ** 2, axis=0), np.mean(np.abs(g) ** 2, axis=0)
    s_ga = np.mean(g * np.conj(a), axis=0)
    freq_hz = frequencies_hz(DISPLAY_SEGMENT_N, batch.rate_hz)
    shown = (freq_hz >= DISPLAY_BAND_HZ[0]) & (freq_hz <= DISPLAY_BAND_HZ[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = np.abs(s_ga) ** 2 / (s_aa * s_gg)
    return Spectra(
        freq_hz=freq_hz[shown],
        vertical_acceleration=np.sqrt(s_aa[shown]),
        pitch_rate=np.sqrt(s_gg[shown]),
        coherence=coherence[shown],
        phase_rad=np.angle(s_ga[shown]),
    )


def roughness_mps2(spectra: Spectra | None, mean_speed_mps: float) -> float:
    """RMS of the vertical acceleration within BAND_HZ, in m/s2, normalised to 80 km/h. NaN where unknown.

    The displacement density of a road (ISO 8608) falls with the square of the wavenumber; at speed v the power at every
    frequency is proportional to v. So sqrt(integral S_aa df) sqrt(v_ref / v) separates road from speed. It is specific
    to this vehicle and its sensor's place.
    """
    if spectra is None or not mean_speed_mps > 0.0 or len(spectra.freq_hz) < 2:
        return math.nan
    inside = (spectra.freq_hz >= BAND_HZ[0]) & (spectra.freq_hz <= BAND_HZ[1])
    step_hz = float(spectra.freq_hz[1] - spectra.freq_hz[0])
    power = float(np.sum(spectra.vertical_acceleration[inside] ** 2)) * step_hz
    return math.sqrt(power * REFERENCE_SPEED_MPS / mean_speed_mps)
