"""Axes, signs, units and positions of the two inertial sensors, from the correlation of their signals.

A typical half-car (the priors' centre, nothing fitted) predicts the phase and the size of the pitch rate relative to
the vertical acceleration, for a sensor anywhere along the vehicle. Its agreement with the measured cross-spectra is
their normalised inner product,

    Re sum n S_ga conj(M_ga) / sqrt(sum n |S_ga|^2 sum n |M_ga|^2),

over groups of segments and frequencies, S and M each divided by the square root of its two
auto-spectra: 1 for the same phases, -1 for opposite ones. The rear axle follows the front, so a
sensor turned over at the rear is not the same as one at the front.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.calibration.half_car.known_spectra import BAND_HZ, N_SEGMENT, KnownSpectra
from gateway.calibration.half_car.most_probable_vehicle import fit_half_car
from gateway.calibration.half_car.prior import prior_of
from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.estimator import COHERENCE_BAND_HZ
from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.driven import spectral_model
from gateway.core.cross_spectrum.model.expected import expected_spectra
from gateway.core.cross_spectrum.model.matrix import SpectralMatrix
from gateway.core.cross_spectrum.model.parameters import INDEX, Ground
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.vehicle import Load, Vehicle
from gateway.estimate import Z95
from gateway.records import C128, F64

LEAST_COHERENCE: Final = 0.4  # chosen: behind the axles right axes have 0.45 and more, roll or yaw for pitch below 0.35
LEAST_AGREEMENT: Final = 0.62  # chosen: right axes amidships have 0.65 and more at any speed variation
USUAL_SCALE: Final = (0.5, 1.6)  # chosen: right axes are within 0.6 to 1.15, roll above 2.3
SCALE_RANGE: Final = (0.4, 2.5)  # chosen: no road vehicle's pitch rate is further from the usual half-car's
UNIT_RANGE: Final = (0.5, 2.0)  # chosen: of a ratio that a wrong unit explains
DEGREES: Final = 180.0 / np.pi  # per radian
REVERSED_BY: Final = 0.1  # chosen: gain of agreement that proves a reversed sign
BEYOND_AXLES_M: Final = 1.5  # chosen: longest overhang with a sensor
STEP_M: Final = 0.25  # chosen: grid of sensor positions
LOOSE_STD_M: Final = 1.0  # chosen: prior of the sensor's place in this fit
POSITION_OFF_M: Final = 0.3  # chosen: deviation that is reported
POSITION_WRONG_M: Final = 1.0  # chosen: deviation that excludes the run
LEAST_SEGMENTS: Final = 20  # chosen: for a place; a sign needs fewer
BELIEVED_AGREEMENT: Final = 0.92  # chosen: with this agreement the speed's unit is not tested
UNIT_GAIN: Final = 0.04  # chosen: gain of agreement that proves a wrong unit of speed
SPEED_MISREAD: Final = {  # how many times too high the speed then reads; a mile has 1.609344 km
    "its numbers are km/h, but the signal map says m/s": 3.6,
    "its numbers are m/s, but the signal map says km/h": 1.0 / 3.6,
    "its numbers are km/h, but the signal map says mph": 1.609344,
    "its numbers are mph, but the signal map says km/h": 1.0 / 1.609344,
}


@dataclass(frozen=True, slots=True)
class Agreement:
    """The best agreement (-1..1) over all sensor positions, its position, and the size of the pitch rate there.

    ``scale`` is the measured pitch rate over the half-car's, both beside the vertical acceleration.
    """

    best: float
    position_m: float
    scale: float


def reading_of(vehicle: Vehicle, speed_misread: float = 1.0) -> Reading:
    """Settings of the spectra; a speed that reads ``speed_misread`` times too high has its delays corrected."""
    return Reading(vehicle.wheelbase_m * speed_misread, BAND_HZ, N_SEGMENT)


def mended(spectra: CrossSpectra, factor: float) -> CrossSpectra:
    """As if one of the two signals had been multiplied by ``factor``, seen as pitch rate relative to acceleration."""
    size = abs(factor)
    return replace(
        spectra,
        acceleration=spectra.acceleration / size,
        pitch_rate=spectra.pitch_rate * size,
        cross=spectra.cross * np.sign(factor),
        pitch_rate_rms_radps=spectra.pitch_rate_rms_radps * size,
    )


def mean_coherence(spectra: CrossSpectra) -> float:
    """Over the band in which body and pitch move."""
    freq_hz = spectra.freq_hz[1:-1]
    seen = (freq_hz >= COHERENCE_BAND_HZ[0]) & (freq_hz <= COHERENCE_BAND_HZ[1])
    return float(np.mean(spectra.coherence[seen]))


def agreement(spectra: CrossSpectra, load: Load, vehicle: Vehicle) -> Agreement:
    """The best over sensor positions from 1.5 m ahead of the front axle to 1.5 m behind the rear one.

    ``load`` is the half-car's load.
    """
    positions_m = np.arange(-BEYOND_AXLES_M, vehicle.wheelbase_m + BEYOND_AXLES_M + STEP_M / 2.0, STEP_M)
    matrix = _half_cars(spectra, load, vehicle, positions_m)
    (m_aa, m_gg), m_ga = matrix.auto, matrix.cross[0]
    n = spectra.n_segments
    seen: C128 = spectra.cross / np.sqrt(spectra.acceleration * spectra.pitch_rate)
    expected: C128 = m_ga / np.sqrt(m_aa * m_gg)
    inner = np.sum(n * np.real(seen * np.conj(expected)), axis=(1, 2))
    norms = np.sum(n * np.abs(expected) ** 2, axis=(1, 2)) * np.sum(n * np.abs(seen) ** 2)
    at = int(np.argmax(inner / np.sqrt(norms)))
    log_ratio = 0.5 * np.log(spectra.pitch_rate / spectra.acceleration * m_aa[at] / m_gg[at])
    scale = float(np.exp(np.sum(n * log_ratio) / np.sum(n * np.ones_like(log_ratio))))
    return Agreement(float((inner / np.sqrt(norms))[at]), float(positions_m[at]), scale)


def _half_cars(spectra: CrossSpectra, load: Load, vehicle: Vehicle, positions_m: F64) -> SpectralMatrix:
    """The usual half-car's spectra (2, p, b, m) with its sensor at each of positions_m (p,)."""
    theta = np.repeat(prior_of(vehicle).mean[None], len(positions_m), axis=0)
    theta[:, INDEX["sensor_position_m"]] = positions_m
    ground = Ground.of(vehicle)
    payload_kg, share = np.full(len(theta), load.payload_kg), np.full(len(theta), load.front_share)
    return expected_spectra(spectral_model(theta, (payload_kg, share), ground, spectra.freq_hz), spectra)


@dataclass(frozen=True, slots=True)
class Phases:
    """Agreement of the phases with the pitch rate as it is, and with it inverted."""

    upright: Agreement
    turned: Agreement

    @property
    def best(self) -> float:
        """The better of the two agreements."""
        return max(self.upright.best, self.turned.best)

    @property
    def likely(self) -> Agreement:
        """With the sign that the data support."""
        return self.turned if self.is_turned else self.upright

    @property
    def is_turned(self) -> bool:
        """True if the pitch rate fits only when inverted."""
        return self.turned.best > self.upright.best + REVERSED_BY


def phases(spectra: CrossSpectra, run: KnownRun, vehicle: Vehicle) -> Phases:
    """Both signs of the pitch rate compared with the typical half-car.

    It carries the stated load or none, whichever explains more: a wrongly stated load must not look like a wrong axis.
    """
    loads = dict.fromkeys([run.load, Load(0.0, vehicle.empty_front_share_pct)])
    upright, turned = (
        _likeliest([agreement(seen, load, vehicle) for load in loads])
        for seen in (spectra, spectra.with_pitch_reversed())
    )
    return Phases(upright, turned)


def _likeliest(agreements: Sequence[Agreement]) -> Agreement:
    """The best agreement, with the most usual of the scales."""
    best = max(agreements, key=lambda one: one.best)
    return replace(best, scale=min((one.scale for one in agreements), key=lambda scale: abs(np.log(scale))))


def likeliest_speed(as_read: Phases, misread: Mapping[str, Phases]) -> tuple[str | None, Phases]:
    """The mistake of the speed's unit that explains the phases far better than none, if one does, and its phases."""
    what = max(misread, key=lambda mistake: misread[mistake].best, default=None)
    if what is not None and misread[what].best > as_read.best + UNIT_GAIN:
        return what, misread[what]
    return None, as_read


def apart_findings(spectra: CrossSpectra, seen: Phases) -> Iterator[Finding]:
    """Do the two sensors move together as one body does?

    Amidships heave and pitch are nearly independent if the speed varies, so a low coherence alone proves nothing: there
    the phases and the size must at least match a vehicle's.
    """
    coherence, likely = mean_coherence(spectra), seen.likely
    is_vehicle = likely.best >= LEAST_AGREEMENT and USUAL_SCALE[0] <= likely.scale <= USUAL_SCALE[1]
    if coherence < LEAST_COHERENCE and not is_vehicle:
        text = f"coherence of pitch_rate and vertical_acceleration is {coherence:.2f}, and their phases agree with a "
        yield Finding.of(Kind.PITCH_RATE_AXIS, f"{text}vehicle's by {likely.best:.2f}")


def phase_findings(seen: Phases, speed_misread: str | None) -> Iterator[Finding]:
    """Unit of the speed, unit and sign of the pitch rate, if the vertical acceleration is right."""
    if speed_misread is not None:
        text = f"the phases agree with the vehicle's by {seen.best:.2f} if {speed_misread}, and by far less otherwise"
        yield Finding.of(Kind.SPEED_UNIT, text)
    scale = seen.likely.scale
    if not SCALE_RANGE[0] <= scale <= SCALE_RANGE[1]:
        text = f"pitch_rate is {scale:.3g} times that of a vehicle with this vertical acceleration"
        yield Finding.of(Kind.PITCH_RATE_UNIT, text + unit_slip(scale, UNIT_RANGE))
    if seen.is_turned:
        text = f"the phases agree with the vehicle's by {seen.turned.best:.2f} with the opposite sign, "
        yield Finding.of(Kind.PITCH_RATE_SIGN, f"{text}by {seen.upright.best:.2f} with this one")


def unit_slip(ratio: float, within: tuple[float, float]) -> str:
    """The mistake of a rate's unit that leaves a ratio to the expected ``within`` this range; empty if none does."""
    if within[0] <= ratio / DEGREES <= within[1]:
        return ": deg/s read as rad/s"
    return ": rad/s read as deg/s" if within[0] <= ratio * DEGREES <= within[1] else ""


def position_findings(spectra: CrossSpectra, run: KnownRun, vehicle: Vehicle) -> Iterator[Finding]:
    """The sensor's position by this run alone, compared with the campaign's; signs and units being right."""
    if spectra.n_total < LEAST_SEGMENTS:
        return
    position_m, std_m = fitted_position_m(spectra, run, vehicle)
    off_m = abs(position_m - vehicle.sensor_position_m)
    doubt_m = 3.0 * float(np.hypot(std_m, vehicle.sensor_position_std_m))
    if off_m > max(POSITION_OFF_M, doubt_m):
        is_wrong = off_m > max(POSITION_WRONG_M, doubt_m)
        by_spectra = f"{position_m:.2f} ± {Z95 * std_m:.2f} m (95 %)"
        text = f"sensor_position_m is {vehicle.sensor_position_m:g}, the spectra say {by_spectra}"
        yield Finding.of(Kind.SENSOR_POSITION, text, Severity.FAULT if is_wrong else Severity.WARNING)


def fitted_position_m(spectra: CrossSpectra, run: KnownRun, vehicle: Vehicle) -> tuple[float, float]:
    """The most probable sensor position of one run and its standard deviation, the rest of the vehicle unknown too."""
    start_m = agreement(spectra, run.load, vehicle).position_m
    loose = prior_of(replace(vehicle, sensor_position_m=start_m, sensor_position_std_m=LOOSE_STD_M))
    at_rest = fit_half_car([KnownSpectra(run, vehicle, spectra)], loose, loose.start(0.0, 0.0))
    at = INDEX["sensor_position_m"]
    return float(at_rest.x[at]), float(np.sqrt(at_rest.covariance[at, at]))
