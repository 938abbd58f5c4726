"""Cramer-Rao bounds of payload and front share for each kind of observation.

    bound_of(Seen.BOTH, unknown, scene) -> Bound; ``limits_table`` has those of the paper's van on the paper's road

On a road of displacement density s(f) the transforms X of the two sensors are complex Gaussian with

    Sigma = s ( h h^H + slack diag(|front|^2 + |rear|^2) ) + noise,      h = front + rear exp(-j 2 pi f l / v),

and the information in n of them is n tr(Sigma^-1 dSigma Sigma^-1 dSigma) per frequency (Whittle 1953). Without their
phase only the two powers are left, of covariance [[S_aa^2, |S_ga|^2], [|S_ga|^2, S_gg^2]] / n; with one sensor one
power. The road's level and slope in log s are always unknown.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from math import radians
from types import MappingProxyType
from typing import Final

import numpy as np

from benchmarks.accuracy.markdown import table
from gateway.calibration.half_car.known_spectra import BAND_HZ, N_SEGMENT
from gateway.calibration.half_car.prior import prior_of
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.likelihood import EFFECTIVE_SHARE, Point, Whittle
from gateway.core.cross_spectrum.model.half_car import frequency_response
from gateway.core.cross_spectrum.model.parameters import INDEX, Ground, half_car
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.cross_spectrum.predicted import RATE_HZ, Drive, expected_of, steady_spectra
from gateway.core.spectrum import frequencies_hz
from gateway.core.vehicle import Vehicle
from gateway.records import C128, F64
from gateway.units import STANDARD_GRAVITY_MPS2
from gateway.workbench.campaigns import PAPER_PAYLOAD_KG, PAPER_ROUGHNESS_M3, PAPER_WHEELBASE_M

STEP: Final = 1e-5  # chosen: of a difference quotient
PAYLOAD_STEP_KG: Final = 0.1  # chosen, likewise
SPEED: Final = "speed"


class Seen(StrEnum):
    """The observed spectra."""

    ACCELERATION = "acceleration alone"
    POWERS = "two auto-spectra, no phase"
    BOTH = "full matrix"


@dataclass(frozen=True, slots=True)
class Bound:
    """The smallest possible standard deviations."""

    payload_std_kg: float
    front_share_std_pct: float


@dataclass(frozen=True, slots=True)
class Scene:
    """A vehicle at a point (parameters and load) on a road of displacement density road_m3 (f/v)^-2 / v.

    ``slack`` is the incoherent share of both sensors' power; noise are densities, (m/s2)^2/Hz and (rad/s)^2/Hz.
    """

    point: Point
    ground: Ground
    reading: Reading
    drive: Drive
    road_m3: float
    slack: float
    noise_acceleration_m2ps3: float = 0.0
    noise_pitch_rate_rad2ps: float = 0.0


def cramer_rao(
    calibration: CrossSpectrumCalibration,
    payload_kg: float,
    front_share_pct: float,
    drive: Drive,
    unknown: Mapping[str, float] | None = None,
) -> Bound:
    """The bound at one load of the calibrated vehicle.

    ``unknown`` maps parameter names (parameters.PARAMETERS) to the prior standard deviation (of the logarithm of
    positive quantities); the others count as known. Slack counts as part of the vehicle: it is the remainder of model
    error and roll.
    """
    priors = dict(unknown or {})
    free = [INDEX[name] for name in priors]
    point = Point(calibration.parameters, payload_kg, front_share_pct / 100.0)
    spectra = expected_of(steady_spectra(calibration.reading, drive), point, calibration.ground)
    whittle = Whittle(spectra, calibration.ground)
    information = whittle.curvature(point, [*free, len(point.theta), len(point.theta) + 1]).information
    information += np.diag(np.r_[np.array(list(priors.values())) ** -2.0, 0.0, 0.0])
    payload_var, share_var = np.diag(np.linalg.inv(information))[-2:]
    return Bound(float(np.sqrt(payload_var)), 100.0 * float(np.sqrt(share_var)))


def bound_of(seen: Seen, unknown: Mapping[str, float], scene: Scene) -> Bound:
    """The smallest standard deviations of payload and front share of any unbiased estimator.

    ``unknown`` maps names of parameters.PARAMETERS, or "speed", to the prior standard deviation of their logarithms;
    everything else about the vehicle is known.
    """
    freq_hz = _frequencies_hz(scene.reading)
    sigma = _sigma(scene, freq_hz)
    slopes = [_slope(scene, freq_hz, name) for name in (*unknown, "payload", "share")]
    road = sigma - _noise(scene)[:, :, None]
    slopes += [road, road * (np.log(freq_hz) - np.mean(np.log(freq_hz)))]
    n = EFFECTIVE_SHARE * max(1.0, 2.0 * scene.drive.duration_s * RATE_HZ / scene.reading.n_segment - 1.0)
    information = n * _INFORMATION[seen](sigma, np.array(slopes))
    k = len(unknown)
    information[range(k), range(k)] += np.array(list(unknown.values())) ** -2.0
    payload_var, share_var = np.diag(np.linalg.inv(information))[k : k + 2]
    return Bound(float(np.sqrt(payload_var)), 100.0 * float(np.sqrt(share_var)))


def _frequencies_hz(reading: Reading) -> F64:
    every_hz = frequencies_hz(reading.n_segment, RATE_HZ)
    return every_hz[(every_hz >= reading.band_hz[0]) & (every_hz <= reading.band_hz[1])]


def _noise(scene: Scene) -> F64:
    return np.diag([scene.noise_acceleration_m2ps3, scene.noise_pitch_rate_rad2ps])


def _sigma(scene: Scene, freq_hz: F64) -> C128:
    """(2, 2, m) expected matrix of acceleration and pitch rate."""
    point, speed_mps = scene.point, scene.drive.speed_mps
    r = frequency_response(half_car(point.theta, scene.ground), point.payload_kg, point.front_share, freq_hz)
    front = np.stack([r.acceleration_front, r.pitch_rate_front])
    rear = np.stack([r.acceleration_rear, r.pitch_rate_rear])
    late = np.exp(-2j * np.pi * freq_hz * scene.ground.wheelbase_m / speed_mps)
    path = front + rear * late
    apart = np.eye(2)[:, :, None] * (np.abs(front) ** 2 + np.abs(rear) ** 2)
    road = scene.road_m3 * speed_mps / freq_hz**2
    sigma: C128 = road * (path[:, None] * path[None].conj() + scene.slack * apart) + _noise(scene)[:, :, None]
    return sigma


def _slope(scene: Scene, freq_hz: F64, name: str) -> C128:
    """Central difference (2, 2, m) of sigma by one unknown."""
    step = PAYLOAD_STEP_KG if name == "payload" else STEP
    up, down = (_sigma(_moved(scene, name, by), freq_hz) for by in (step, -step))
    slope: C128 = (up - down) / (2.0 * step)
    return slope


def _moved(scene: Scene, name: str, by: float) -> Scene:
    point = scene.point
    if name == SPEED:  # only the delay: the road's level is unknown anyway
        longer = scene.drive.speed_mps * np.exp(by)
        return replace(
            scene, drive=replace(scene.drive, speed_mps=longer), road_m3=scene.road_m3 * scene.drive.speed_mps / longer
        )
    if name == "payload":
        return replace(scene, point=replace(point, payload_kg=point.payload_kg + by))
    if name == "share":
        return replace(scene, point=replace(point, front_share=point.front_share + by))
    theta = point.theta.copy()
    theta[INDEX[name]] += by
    return replace(scene, point=replace(point, theta=theta))


def _of_acceleration(sigma: C128, slopes: C128) -> F64:
    relative = np.real(slopes[:, 0, 0] / sigma[0, 0])
    information: F64 = relative @ relative.T
    return information


def _of_powers(sigma: C128, slopes: C128) -> F64:
    """For the two mean powers, jointly Gaussian about their expectation."""
    power = np.real(np.stack([sigma[0, 0], sigma[1, 1]]))
    shared = np.abs(sigma[1, 0]) ** 2
    covariance = np.moveaxis(np.array([[power[0] ** 2, shared], [shared, power[1] ** 2]]), -1, 0)
    moved = np.real(np.stack([slopes[:, 0, 0], slopes[:, 1, 1]], axis=1))
    information: F64 = np.einsum("iam,mab,jbm->ij", moved, np.linalg.inv(covariance), moved)
    return information


def _of_matrix(sigma: C128, slopes: C128) -> F64:
    inverse = np.linalg.inv(np.moveaxis(sigma, -1, 0))
    relative = np.einsum("mab,ibcm->imac", inverse, slopes)
    information: F64 = np.real(np.einsum("imab,jmba->ij", relative, relative))
    return information


_INFORMATION: Final[Mapping[Seen, Callable[[C128, C128], F64]]] = {
    Seen.ACCELERATION: _of_acceleration,
    Seen.POWERS: _of_powers,
    Seen.BOTH: _of_matrix,
}


PAPER_VAN: Final = Vehicle(
    name="paper_van",
    empty_mass_kg=1240.0,
    wheelbase_m=PAPER_WHEELBASE_M,
    empty_front_share_pct=50.0,
    sensor_position_m=3.1,
)
MODEL_SLACK: Final = 0.02  # chosen: share of unmodelled power
SENSOR_NOISE: Final = (
    (150e-6 * STANDARD_GRAVITY_MPS2) ** 2,
    radians(0.01) ** 2,
)  # per hertz, usual for automotive MEMS
SHARE_RANGE_PCT: Final = 20.0  # the paper's range of front shares
MILD: Final[Mapping[str, float]] = MappingProxyType(
    {
        "spring_front_npm": 0.1,
        "spring_rear_npm": 0.1,
        "damper_front_nspm": 0.2,
        "damper_rear_nspm": 0.2,
        "tyre_front_npm": 0.1,
        "tyre_rear_npm": 0.1,
        SPEED: 0.01,
    }
)


def limits_table(drive: Drive) -> str:
    """Bounds at half the rated payload, 50 % in front, as a table in Markdown; percent are of the paper's ranges."""
    ground = Ground.of(PAPER_VAN)
    point = Point(prior_of(PAPER_VAN).mean, PAPER_PAYLOAD_KG / 2.0, 0.5)
    reading = Reading(PAPER_VAN.wheelbase_m, BAND_HZ, N_SEGMENT)
    scenes = {
        f"{100.0 * MODEL_SLACK:g} % slack": Scene(point, ground, reading, drive, PAPER_ROUGHNESS_M3, MODEL_SLACK),
        "sensor noise": Scene(point, ground, reading, drive, PAPER_ROUGHNESS_M3, 0.0, *SENSOR_NOISE),
    }
    rows = [
        (seen, "mild priors" if unknown else "known", name, *_cells(bound_of(seen, unknown, scene)))
        for unknown in ({}, MILD)
        for seen in Seen
        for name, scene in scenes.items()
    ]
    return "\n".join(table(("seen", "vehicle", "beside the road", "payload", "front share"), rows)) + "\n"


def _cells(bound: Bound) -> tuple[str, str]:
    kg, pp = bound.payload_std_kg, bound.front_share_std_pct
    return f"{kg:.2f} kg, {100.0 * kg / PAPER_PAYLOAD_KG:.2f} %", f"{pp:.3f} pp, {100.0 * pp / SHARE_RANGE_PCT:.2f} %"
