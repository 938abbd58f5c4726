"""A vehicle on a road: its responses to each axle, as segments see them at their speed and amplitude.

Groups with the same load differ by three things:
- speed, through the delay of the rear axle and through the tracks: axles whose wheels do not follow one track, and the
two tracks of one axle, meet roads that are less alike at shorter waves;
- the movement of each axle, through its friction;
- sensor noise, which is the same on every road, and so matters more on a smooth one.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeVar

import numpy as np

from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.friction import at_levels, level_weights
from gateway.core.cross_spectrum.model.half_car import half_car_numbers
from gateway.core.cross_spectrum.model.motion import Frame, Motion, Numbers
from gateway.core.cross_spectrum.model.parameters import (
    NOISES,
    SLACK_KNOTS,
    VEHICLE_PARAMETERS,
    Ground,
    half_car,
    has_roll,
    rolling_car,
    slack_weights,
    value_of,
)
from gateway.core.cross_spectrum.model.rolling_car import SidewaysLoad, rolling_numbers
from gateway.core.cross_spectrum.model.tracks import coherence_of
from gateway.records import C128, F64

Spectra = TypeVar("Spectra", F64, C128)

IMAGINARY_STEP: Final = 1e-30  # its square vanishes beside any number here


@dataclass(frozen=True, slots=True)
class SpectralModel:
    """Vehicles theta (..., n) with their loads, solved but not yet evaluated at a speed.

    ``motion`` is solved at each of friction.levels(), its numbers being (..., 5, 1); slack (p, ..., m) is a share of
    each sensor's power, least_slack plus the parameters' part; noise (p, ..., 1) is a density in the square of the
    sensor's unit per hertz. tracks_apart_m and twist_level are None for a vehicle without roll.
    """

    motion: Motion
    slack: F64
    least_slack: float
    noise: F64
    track_offset_m: F64
    delay_scale: F64
    rear_lag_s: F64
    wheelbase_m: float
    tracks_apart_m: F64 | None = None
    twist_level: F64 | None = None


@dataclass(frozen=True, slots=True)
class Driven:
    """The responses of p sensors for each group.

    paths (p, s, ..., b, m) are by front and rear axle with both tracks alike, then with one against the other; late (p,
    s / 2, ..., b, m) are those by the rear axle times ``phase``, its phase times its coherence with the front. twist is
    the power of the tracks' difference relative to their mean (None: no roll).
    """

    paths: C128
    late: C128
    phase: C128
    twist: F64 | None

    @property
    def front(self) -> C128:
        """(p, s / 2, ..., b, m) the paths by the front axle."""
        return self.paths[:, ::2]

    @property
    def rear(self) -> C128:
        """(p, s / 2, ..., b, m) the paths by the rear axle."""
        return self.paths[:, 1::2]

    def of_tracks(self, x: Spectra) -> Spectra:
        """Sum of x (p, s / 2, ..., b, m) over both tracks alike, and one against the other."""
        return x[:, 0] if self.twist is None else x[:, 0] + self.twist * x[:, 1]


def spectral_model(
    theta: F64,
    load: tuple[F64 | float, ...],
    ground: Ground,
    freq_hz: F64,
    n_sensors: int = 2,
    numbers: Numbers | None = None,
) -> SpectralModel:
    """Solve for parameter vectors theta (..., n) and loads at freq_hz (m,), for the first ``n_sensors`` sensors.

    ``load`` is payload in kg, front share (0..1) and, for a vehicle with roll, the centre of gravity left of the centre
    line in m, each (...,). ``numbers`` are the result of numbers_of for them, if already known.
    """
    with_roll = has_roll(theta)
    frame = Frame(ground.wheelbase_m, ground.half_track_m if with_roll else None)
    return SpectralModel(
        motion=Motion(numbers_of(theta, load, ground) if numbers is None else numbers, frame, freq_hz, n_sensors),
        slack=ground.least_slack + np.array([_slack(theta, knots, freq_hz) for knots in SLACK_KNOTS[:n_sensors]]),
        least_slack=ground.least_slack,
        noise=np.array([value_of(theta, name) for name in NOISES[:n_sensors]]),
        track_offset_m=value_of(theta, "track_offset_m"),
        delay_scale=value_of(theta, "delay_scale"),
        rear_lag_s=value_of(theta, "rear_lag_s"),
        wheelbase_m=ground.wheelbase_m,
        tracks_apart_m=value_of(theta, "tracks_apart_m") if with_roll else None,
        twist_level=value_of(theta, "twist_level") if with_roll else None,
    )


def numbers_of(theta: F64, load: tuple[F64 | float, ...], ground: Ground) -> Numbers:
    """The numbers in the equations of motion (..., 5, 1) at each of friction.levels()."""
    payload_kg, front_share, *cg_left_m = (np.asarray(one)[..., None, None] for one in load)
    still = theta[..., None, :]
    if not has_roll(theta):
        return half_car_numbers(at_levels(half_car(still, ground), theta), payload_kg, front_share)
    car = rolling_car(still, ground)
    acting = replace(car, half_car=at_levels(car.half_car, theta))
    return rolling_numbers(acting, SidewaysLoad(payload_kg, front_share, cg_left_m[0]))


def are_in_motion(entries: Iterable[int], n: int) -> list[int]:
    """Those of ``entries`` that are in the equations of motion; from n on they are the load's, before it theta's."""
    return [entry for entry in entries if entry >= n or entry in VEHICLE_PARAMETERS]


def numbers_about(theta: F64, load: tuple[float, ...], ground: Ground, entries: Sequence[int]) -> tuple[Numbers, F64]:
    """numbers_of one vehicle theta (n,) with its load, and by how much they move (5, q, k) with each of ``entries``,
    which are in the equations of motion.

    A small step along the imaginary axis moves the imaginary part by the step times the slope and leaves the real part
    unchanged (W. Squire, G. Trapp, SIAM Rev. 40, 1998): one evaluation gives both without a difference.
    """
    n = len(theta)
    stepped = np.empty((1 + len(entries), n + len(load)), complex)  # the first is where it is
    stepped[:, :n], stepped[:, n:] = theta, load
    stepped[range(1, len(stepped)), entries] += 1j * IMAGINARY_STEP
    numbers = numbers_of(stepped[:, :n], tuple(stepped[:, n:].T), ground).all[..., 0]
    slopes = np.imag(numbers[:, 1:]) / IMAGINARY_STEP
    return Numbers(np.real(numbers[:, 0, :, None])), np.ascontiguousarray(slopes.transpose(2, 0, 1))


def driven(model: SpectralModel, spectra: CrossSpectra) -> Driven:
    """The model at the speeds and amplitudes of the groups of ``spectra``."""
    weights = level_weights(spectra.log_movement)
    later_s = spectra.delay_s * model.delay_scale[..., None, :] + model.rear_lag_s[..., None, :]
    phase = spectra.delay_phase * np.exp(-2j * np.pi * spectra.freq_hz * later_s)
    phase = phase * coherence_of(along(model.track_offset_m, model, spectra))
    paths: C128 = (weights @ model.motion.paths.view(float)).view(complex)  # the weights are real
    return Driven(paths, phase * paths[:, 1::2], phase, _twist(model, spectra))


def along(apart_m: F64, model: SpectralModel, spectra: CrossSpectra) -> F64:
    """2 pi n d (..., b, m), wavenumber n = f/v times the distance d (..., 1) between two tracks."""
    per_metre = spectra.freq_hz * spectra.delay_s / model.wheelbase_m
    x: F64 = 2.0 * np.pi * per_metre * apart_m[..., None, :]
    return x


def _twist(model: SpectralModel, spectra: CrossSpectra) -> F64 | None:
    """(..., b, m) power of half the tracks' difference over that of their mean: (1 - c) / (1 + c), times the level.

    c is the coherence of left and right (:func:`along`); two tracks of one density S have mean and half difference of S
    (1 + c) / 2 and S (1 - c) / 2, which do not correlate. The level is 1 on an isotropic road.
    """
    if model.tracks_apart_m is None or model.twist_level is None:
        return None
    coherence = coherence_of(along(model.tracks_apart_m, model, spectra))
    twist: F64 = model.twist_level[..., None, :] * (1.0 - coherence) / (1.0 + coherence)
    return twist


def _slack(theta: F64, knots: range, freq_hz: F64) -> F64:
    """Slack (..., m) of one sensor above the least: log-linear between its knots."""
    slack: F64 = np.exp(theta[..., knots.start : knots.stop] @ slack_weights(freq_hz))
    return slack
