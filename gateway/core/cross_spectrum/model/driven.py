"""A vehicle on a road: its responses to each axle, and what segments see of them at their speed and amplitude.

Three things make groups differ that carry the same load:

- speed, by the delay of the rear axle, and by the tracks: axles whose wheels do not run in one track, and the two
  tracks of one axle, meet roads that resemble each other the less the shorter the waves are;
- how much each axle moves, by its friction;
- sensor noise, which is the same on every road, so that it counts for more on a smooth one.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import k1

from gateway.core.cross_spectrum.measured import CrossSpectra
from gateway.core.cross_spectrum.model.friction import at_levels, level_weights
from gateway.core.cross_spectrum.model.half_car import half_car_numbers
from gateway.core.cross_spectrum.model.motion import Frame, Motion, Numbers
from gateway.core.cross_spectrum.model.parameters import (
    NOISES,
    PARAMETERS,
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
from gateway.records import C128, F64

Paths = tuple[C128, ...]
"""Responses (p, ..., m) of p sensors by front and rear axle, both tracks alike; then one against the other."""

IMAGINARY_STEP: Final = 1e-30  # its square is nothing beside any number here


@dataclass(frozen=True, slots=True)
class SpectralModel:
    """Vehicles theta (..., n) with their loads, solved but not yet driven at any speed.

    ``motion`` is solved at each of friction.levels(), its numbers being (..., 5, 1); slack (p, ..., m) is
    a share of each sensor's power, least_slack and what parameters add; noise (p, ..., 1) is a density in the square of
    the sensor's unit per hertz.
    tracks_apart_m and twist_level are None for a vehicle that does not roll.
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
    """What groups see: responses (p, ..., b, m); the rear axle's phase times its coherence with the front's; and the
    power of what the tracks do against each other over what they do together (None: no roll).
    """

    paths: Paths
    phase: C128
    twist: F64 | None


def spectral_model(
    theta: F64,
    load: tuple[F64 | float, ...],
    ground: Ground,
    freq_hz: F64,
    n_sensors: int = 2,
    numbers: Numbers | None = None,
) -> SpectralModel:
    """Solve for parameter vectors theta (..., n) and loads at freq_hz (m,), for the first ``n_sensors`` sensors.

    ``load`` is payload in kg, front share (0..1) and, for a vehicle that rolls, the centre of gravity's place left of
    the centre line in m, each (...,). ``numbers`` is what numbers_of makes of them, where it is known already.
    """
    with_roll = has_roll(theta)
    frame = Frame(ground.wheelbase_m, ground.half_track_m if with_roll else None)
    return SpectralModel(
        motion=Motion(numbers_of(theta, load, ground) if numbers is None else numbers, frame, freq_hz, n_sensors),
        slack=ground.least_slack + np.stack([_slack(theta, knots, freq_hz) for knots in SLACK_KNOTS[:n_sensors]]),
        least_slack=ground.least_slack,
        noise=np.stack([value_of(theta, name) for name in NOISES[:n_sensors]]),
        track_offset_m=value_of(theta, "track_offset_m"),
        delay_scale=value_of(theta, "delay_scale"),
        rear_lag_s=value_of(theta, "rear_lag_s"),
        wheelbase_m=ground.wheelbase_m,
        tracks_apart_m=value_of(theta, "tracks_apart_m") if with_roll else None,
        twist_level=value_of(theta, "twist_level") if with_roll else None,
    )


def numbers_of(theta: F64, load: tuple[F64 | float, ...], ground: Ground) -> Numbers:
    """What is in the equations of motion (..., 5, 1) at each of friction.levels()."""
    payload_kg, front_share, *cg_left_m = (np.asarray(one)[..., None, None] for one in load)
    still = theta[..., None, :]
    if not has_roll(theta):
        return half_car_numbers(at_levels(half_car(still, ground), theta), payload_kg, front_share)
    car = rolling_car(still, ground)
    acting = replace(car, half_car=at_levels(car.half_car, theta))
    return rolling_numbers(acting, SidewaysLoad(payload_kg, front_share, cg_left_m[0]))


def entries_in_motion(n: int) -> list[int]:
    """Which entries of theta (n,) are in the equations of motion, and from n on those of the load."""
    n_load = 3 if n > len(PARAMETERS) else 2
    return [*(entry for entry in range(n) if entry in VEHICLE_PARAMETERS), *range(n, n + n_load)]


def numbers_about(theta: F64, load: tuple[float, ...], ground: Ground) -> tuple[Numbers, F64]:
    """numbers_of one vehicle theta (n,) with its load, and by how much they move (5, q, k) with each entry that is in
    the equations of motion.

    A small step along the imaginary axis moves the imaginary part by the step times the slope and leaves the real part
    as it was (W. Squire, G. Trapp, SIAM Rev. 40, 1998): one evaluation gives both, and no difference is taken.
    """
    n = len(theta)
    entries = entries_in_motion(n)
    stepped = np.repeat(np.r_[theta, load][None].astype(complex), len(entries), axis=0)
    stepped[range(len(entries)), entries] += 1j * IMAGINARY_STEP
    numbers = numbers_of(stepped[:, :n], tuple(stepped[:, n:].T), ground).all[..., 0]
    slopes = np.imag(numbers) / IMAGINARY_STEP
    return Numbers(np.real(numbers[:, 0, :, None])), np.ascontiguousarray(slopes.transpose(2, 0, 1))


def driven(model: SpectralModel, spectra: CrossSpectra) -> Driven:
    """The model as the groups of ``spectra`` drive."""
    weights = level_weights(spectra.log_movement)
    later_s = spectra.delay_s * model.delay_scale[..., None, :] + model.rear_lag_s[..., None, :]
    phase = spectra.delay_phase * np.exp(-2j * np.pi * spectra.freq_hz * later_s)
    x = along(model.track_offset_m, model, spectra)
    paths = _mixed(weights, model.motion.paths)
    return Driven(tuple(np.moveaxis(paths, 1, 0)), phase * (x * k1(x)), _twist(model, spectra))


def _mixed(weights: F64, paths: C128) -> C128:
    """(p, s, ..., b, m) of paths (p, s, ..., 5, m): weights (b, 5) are real, and so is the product that is taken."""
    parts = np.ascontiguousarray(np.moveaxis(paths, -2, 0)).view(float)
    mixed: C128 = (weights @ parts.reshape(len(parts), -1)).view(complex)
    return np.moveaxis(mixed.reshape(len(weights), *paths.shape[:-2], paths.shape[-1]), 0, -2)


def along(apart_m: F64, model: SpectralModel, spectra: CrossSpectra) -> F64:
    """2 pi n d (..., b, m), wavenumber n = f/v times the distance d (..., 1) between two tracks.

    On a road that is alike in all directions, of displacement density n^-2, two parallel tracks have
    the coherence x K1(x) (K. M. A. Kamash and J. D. Robson, J. Sound Vib. 57, 1978).
    """
    per_metre = spectra.freq_hz * spectra.delay_s / model.wheelbase_m
    x: F64 = 2.0 * np.pi * per_metre * apart_m[..., None, :]
    return x


def _twist(model: SpectralModel, spectra: CrossSpectra) -> F64 | None:
    """(..., b, m) power of half the tracks' difference over that of their mean: (1 - c) / (1 + c), times the level.

    c is the coherence of left and right (:func:`along`); two tracks of one density S have mean and half difference of
    S (1 + c) / 2 and S (1 - c) / 2, which do not correlate. The level is 1 on a road that is alike in all directions.
    """
    if model.tracks_apart_m is None or model.twist_level is None:
        return None
    x = along(model.tracks_apart_m, model, spectra)
    coherence = x * k1(x)
    twist: F64 = model.twist_level[..., None, :] * (1.0 - coherence) / (1.0 + coherence)
    return twist


def _slack(theta: F64, knots: range, freq_hz: F64) -> F64:
    """Slack (..., m) of one sensor above the least: log-linear between its knots."""
    slack: F64 = np.exp(theta[..., knots.start : knots.stop] @ slack_weights(freq_hz))
    return slack
