"""Spectra of both sensors for every load, with the scatter expected for the driven time."""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import gammaincinv

from gateway.calibration.stated_drive import StatedDrive
from gateway.core.ratio_index.index import Band, RatioIndexCalibration
from gateway.core.spectrum import frequencies_hz, segment_starts, segment_transforms
from gateway.records import F64, Batch
from gateway.reports.charts import Axis, Chart, LineMark, Mark, Panel, Ribbon, Section, Span

N_SEGMENT: Final = 512  # chosen: 0.1 Hz at 50 Hz
SHOWN_HZ: Final = (0.7, 15.0)  # chosen: around the bands of the estimators
MOST_CURVES: Final = 6  # chosen: more are not readable
OVERLAP_LOSS: Final = 1.0 + 2.0 / 36.0  # of independence between Hann segments that overlap by half (Welch 1967)
ACCELERATION: Final = "acceleration"
PITCH_RATE: Final = "pitch_rate"
_AXIS: Final = {ACCELERATION: "vertical acceleration [m/s²/√Hz]", PITCH_RATE: "pitch rate [rad/s/√Hz]"}


@dataclass(frozen=True, slots=True, eq=False)
class Density:
    """Amplitude density and its 95 % limits (m,) at freq_hz (m,), from n_segments half-overlapping segments."""

    freq_hz: F64
    amplitude: F64
    low: F64
    high: F64
    n_segments: int


def density_of(batches: Iterable[Batch], sensor: str) -> Density | None:
    """Root of the mean power over all segments of ``batches``; None where no segment fits between the gaps.

    A mean of K segments follows chi-square with about 2 K / OVERLAP_LOSS degrees of freedom (P. D. Welch,
    IEEE Trans. Audio Electroacoust. 15, 1967); roads differ besides.
    """
    powers, rate_hz = [], 1.0
    for batch in batches:
        x = batch.vertical_acceleration_mps2 if sensor == ACCELERATION else batch.pitch_rate_radps
        starts = segment_starts(batch.usable & np.isfinite(x), N_SEGMENT, N_SEGMENT // 2)
        if starts.size:
            powers.append(np.abs(segment_transforms(x, starts, N_SEGMENT, batch.rate_hz)) ** 2)
            rate_hz = batch.rate_hz
    if not powers:
        return None
    n_segments = sum(len(power) for power in powers)
    freq_hz = frequencies_hz(N_SEGMENT, rate_hz)
    kept = (freq_hz >= SHOWN_HZ[0]) & (freq_hz <= SHOWN_HZ[1])
    mean = np.concatenate(powers)[:, kept].mean(axis=0)
    half_dof = n_segments / OVERLAP_LOSS
    low, high = (np.sqrt(mean * half_dof / gammaincinv(half_dof, p)) for p in (0.975, 0.025))
    return Density(freq_hz[kept], np.sqrt(mean), low, high, n_segments)


def spectra_section(runs: Sequence[StatedDrive], ratio_index: RatioIndexCalibration | None) -> Section | None:
    """Acceleration by payload and pitch rate by front share, a chart each, for a colour is one load or one share.

    Runs of which the load is not known are left out. None where there is no spectrum at all.
    """
    by_payload, by_share = defaultdict(list), defaultdict(list)
    for run in runs:
        if run.is_known:
            by_payload[run.payload_kg].append(run)
            by_share[round(run.front_share_pct, 1)].append(run)
    loads = {f"{kg:g} kg": by_payload[kg] for kg in sorted(by_payload)}
    shares = {f"{pct:.1f} %": by_share[pct] for pct in sorted(by_share)}
    drawn = (
        _chart(ACCELERATION, "for each payload", loads, ratio_index.acceleration_bands if ratio_index else None),
        _chart(PITCH_RATE, "for front shares", shares, ratio_index.pitch_rate_bands if ratio_index else None),
    )
    charts = tuple(chart for chart in drawn if chart is not None)
    return Section("spectra", "Spectra", (), charts) if charts else None


def _chart(
    sensor: str, by: str, groups: Mapping[str, list[StatedDrive]], bands: tuple[Band, Band] | None
) -> Chart | None:
    """A curve for each group of runs, or for some of many; None without a spectrum."""
    labels = list(groups)
    some = sorted({round(at) for at in np.linspace(0, len(labels) - 1, MOST_CURVES).tolist()}) if labels else []
    marks: list[Mark] = []
    for colour, label in enumerate(labels[i] for i in some):
        density = density_of((b for run in groups[label] for b in run.batches if not b.rejected), sensor)
        if density is not None:
            marks.append(Ribbon(density.freq_hz, density.low, density.high, "", colour))
            marks.append(LineMark(density.freq_hz, density.amplitude, label, colour))
    if not marks:
        return None
    spans = [
        Span(band.centre_hz - 0.5 * band.width_hz, band.centre_hz + 0.5 * band.width_hz, name, colour)
        for band, name, colour in zip(bands or (), ("numerator of the index", "denominator"), (6, 7), strict=False)
    ]
    name = sensor.replace("_", " ")
    return Chart(
        f"spectra_{sensor}",
        f"Amplitude density of the {name} in the identification part, {by}. The ribbon is the 95 % scatter of the mean "
        "over that much driving on the same road; roads differ besides."
        + (" Shaded upright: the bands whose ratio is the index." if bands else ""),
        f"Spectra of the {name} {by}: more load lowers and moves the resonances of body and wheels.",
        (Panel(Axis("frequency [Hz]"), Axis(_AXIS[sensor], is_log=True), (*spans, *marks)),),
        row_height_px=380,
    )
