"""The expected spectral matrix of a vehicle's sensors for every group of segments.

Both axles meet one road, so the matrix is that of two coherent paths (with roll four, for the mean and half the
difference of the tracks); the incoherent part, slack and sensor noise, is added. Groups with the same load differ by
speed, through the delay of the rear axle and through the tracks: axles whose wheels do not follow one track, and the
two tracks of one axle, meet roads that are less alike at shorter waves. They differ by the movement of each axle,
through its friction, and by sensor noise, which is the same on every road and so matters more on a smooth one.

A spectral matrix of p sensors is held by its p^2 real parts: the diagonal, then real and imaginary part of each of
PAIRS. Shapes: k points, b groups, m + 2 frequencies before the taper and m after it, s ways as in response.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from gateway.core.vehicle import Load
from gateway.model.car import USUAL_LEVEL, Ground, level_weights, natural, numbers_of
from gateway.model.response import Frequencies, Motion
from gateway.model.spectra import PAIRS, CrossSpectra, log_amplitude_of
from gateway.model.table import INDEX, SLACK_KNOTS_HZ, N
from gateway.model.tracks import coherence_of
from gateway.records import C128, F64

ROAD_EXPONENT: Final = -2.0  # displacement density of a road falls about as frequency squared (ISO 8608)

_SENSORS = "acceleration", "pitch_rate", "roll_rate"
KNOTS: Final = [[INDEX[f"slack_{one}_{hz:g}hz"] for hz in SLACK_KNOTS_HZ] for one in _SENSORS]
NOISES: Final = [
    INDEX[name] for name in ("noise_acceleration_m2ps3", "noise_pitch_rate_rad2ps", "noise_roll_rate_rad2ps")
]
DELAY_SCALE, REAR_LAG, TRACK_OFFSET = (INDEX[name] for name in ("delay_scale", "rear_lag_s", "track_offset_m"))
TRACKS_APART, TWIST_LEVEL = INDEX["tracks_apart_m"], INDEX["twist_level"]


class Groups:
    """The figures of measured spectra that the model needs, computed once."""

    def __init__(self, spectra: CrossSpectra, ground: Ground) -> None:
        self.ground = ground
        self.n_sensors = spectra.n_sensors
        self.at = Frequencies(spectra.freq_hz)
        self.delay_s, self.delay_phase = spectra.delay_s, spectra.delay_phase
        self.weights = level_weights(spectra.log_movement)
        speed_mps = ground.wheelbase_m / spectra.delay_s
        self.speed_mps = float(np.average(speed_mps, weights=spectra.n_segments))
        """The mean, for which the driveline is solved; it is linear in the groups' speeds about it."""
        self.speed_ratio = speed_mps / self.speed_mps
        self.weights_and_speed = np.concatenate([self.weights, (speed_mps - self.speed_mps) * self.weights], axis=1)
        self.road: F64 = spectra.freq_hz**ROAD_EXPONENT / 6.0
        self.log_turns_per_m = np.log(2.0 * np.pi * spectra.freq_hz * spectra.delay_s / ground.wheelbase_m)
        self.inverse_power, self.excess = spectra.inverse_power, spectra.noise
        knots = np.arange(len(SLACK_KNOTS_HZ))
        between = np.interp(np.log(spectra.freq_hz), np.log(SLACK_KNOTS_HZ), knots)
        self.hats = np.maximum(0.0, 1.0 - np.abs(between - knots[:, None]))
        """(10, m + 2) weight of each knot of the logarithm of slack."""


class Expected:
    """The matrices of k vehicles theta (k, n) with their loads (2, k), with roll (3, k), up to the road's level.

    theta may be (1, n): one vehicle with k loads.
    """

    def __init__(self, theta: F64, load: F64, groups: Groups) -> None:
        self.theta, self.load, self.groups = theta, load, groups
        self.natural = natural(theta)
        p, ground, at = groups.n_sensors, groups.ground, groups.at
        self.motion = Motion(numbers_of(self.natural, load, ground), ground, at, p, groups.speed_mps)
        both = np.concatenate([self.motion.paths, self.motion.by_speed()], axis=-2)
        self.paths: C128 = (groups.weights_and_speed @ both.view(float)).view(complex)
        """(p, s, k, b, m + 2) responses of each group, by front and rear axle; then one track against the other."""
        self.phase = self._delayed()
        self.late = self.phase * self.paths[:, 1::2]
        slack = np.exp(self._logs(KNOTS[:p]) @ groups.hats)
        self.slack_above = slack[..., None, :]
        self.slack = ground.least_slack + self.slack_above
        self.twist = self._twisted() if self.motion.rolls else None
        self.by_track = self._parts_by_track()
        """(p^2, s / 2, k, b, m + 2) before taper and noise, of both tracks alike and of one against the other."""
        self.noiseless = tapered(self.of_tracks(self.by_track) * groups.road)
        """(p^2, k, b, m) without sensor noise."""
        self.sums: F64 = self.noiseless[:2].sum(axis=-1)
        """(2, k, b) powers of acceleration and pitch rate, with which the noise grows."""
        mean = np.sqrt(self.sums[0] * self.sums[1]) / self.noiseless.shape[-1]
        self.scale = groups.inverse_power * mean[..., None]
        self.density = self.natural.T[NOISES[:p], :, None, None]
        excess = 0.0 if groups.excess is None else groups.excess[:, None, None]
        self.noise: F64 = (self.density + excess) * self.scale
        """(p, k, b, 1 or m) noise density in spectra whose segments were divided by their power, the geometric mean of
        acceleration's and pitch rate's, estimated as if they were as expected.
        """
        self.parts = self.noiseless.copy()
        self.parts[:p] += self.noise

    def _logs(self, entries: list[list[int]]) -> F64:
        """The parameters at entries (r, c) of each of the k vehicles, shaped (r, k, c)."""
        return np.ascontiguousarray(self.theta[:, entries].swapaxes(0, 1))

    def of(self, entry: int) -> F64:
        """One parameter of each of the k vehicles, shaped (k, 1, 1)."""
        return np.asarray(self.natural[:, entry, None, None])

    def log_turns(self, entry: int) -> F64:
        """(k, b, m + 2) logarithm of 2 pi times the wavenumber times a distance of tracks."""
        return np.asarray(self.groups.log_turns_per_m + self.theta[:, entry, None, None])

    def _delayed(self) -> C128:
        """(k, b, m + 2) phase of the rear axle's road times its coherence with the front's."""
        g = self.groups
        angle = g.at.omega * (g.delay_s * self.of(DELAY_SCALE) + self.of(REAR_LAG))
        phase = np.empty(angle.shape, complex)
        phase.real, phase.imag = np.cos(angle), -np.sin(angle)
        phase *= g.delay_phase
        self.coherence = coherence_of(self.log_turns(TRACK_OFFSET))
        phase *= self.coherence
        return phase

    def _twisted(self) -> F64:
        """(k, b, m + 2) power of half the tracks' difference over that of their mean: (1 - c) / (1 + c), times the
        level.

        c is the coherence of left and right; two tracks of one density S have mean and half difference of S (1 + c) / 2
        and S (1 - c) / 2, which do not correlate. The level is 1 on an isotropic road.
        """
        coherence = coherence_of(self.log_turns(TRACKS_APART))
        return np.asarray(self.of(TWIST_LEVEL) * (1.0 - coherence) / (1.0 + coherence))

    def of_tracks(self, x: F64) -> F64:
        """Sum of x (r, s / 2, ...) over both tracks alike, and one against the other."""
        return x[:, 0] if self.twist is None else x[:, 0] + self.twist * x[:, 1]

    def _parts_by_track(self) -> F64:
        """|front|^2 + |rear|^2 + late conj(front) + its conjugate; slack multiplies the squares."""
        front, rear, late = self.paths[:, ::2], self.paths[:, 1::2], self.late
        p = len(front)
        parts = np.empty((p * p, *front.shape[1:]))
        self.own = _power(front)
        self.own += _power(rear)
        np.multiply(1.0 + self.slack[:, None], self.own, out=parts[:p])
        parts[:p] += 2.0 * (late.real * front.real + late.imag * front.imag)
        beside = np.conj(front + late)
        for pair, (i, j) in enumerate(PAIRS[: p * (p - 1) // 2]):
            cross = front[i] * beside[j]
            cross += rear[i] * np.conj(rear[j])
            cross += late[i] * np.conj(front[j])
            parts[p + 2 * pair], parts[p + 2 * pair + 1] = cross.real, cross.imag
        return parts


def tapered(parts: F64) -> F64:
    """(..., m) of parts (..., m + 2), mixed by a Hann taper with weights 1:4:1; ``road`` is over their sum."""
    mixed = 4.0 * parts[..., 1:-1]
    mixed += parts[..., :-2]
    mixed += parts[..., 2:]
    return np.asarray(mixed)


def _power(x: C128) -> F64:
    return np.asarray(x.real**2 + x.imag**2)


def log_stroke_speeds(spectra: CrossSpectra, theta: F64, load: Load, ground: Ground) -> F64:
    """(b, 2) logarithm of the root mean square speed (m/s, within the band) of front and rear springs, on which
    friction depends.

    The sensors show the movement of the body. The stroke of each axle depends in addition on load, speed and vehicle,
    and follows from heave and pitch of a vehicle theta (n,) with that load and its usual friction: the road's level is
    the one that makes the model's sensors move as measured. So a heavy load that calms the body does not look like a
    smooth road, and the axles may differ. The mean logarithm of periodograms, as in the amplitude of ``spectra``, is
    half of Euler's constant below that of the density.
    """
    usual_log_amplitude = spectra.reading.usual_log_amplitude
    if usual_log_amplitude is None:
        raise ValueError("these spectra do not say how much their vehicle usually moves")
    groups = Groups(replace(spectra.without_roll, log_strokes=np.zeros((len(spectra.delay_s), 2))), ground)
    e = Expected(theta[None, :N], np.array([[load.payload_kg], [load.front_share]]), groups)
    moved = spectra.log_amplitude[:, 0] + usual_log_amplitude + 0.5 * np.euler_gamma
    log_road = moved - log_amplitude_of(e.parts[0, 0], e.parts[1, 0])
    strokes = e.motion.strokes()[:, :, 0, USUAL_LEVEL]
    stretched = _power(strokes[:, 0, None] + e.phase[0] * strokes[:, 1, None])
    freq_hz = spectra.freq_hz
    speed = groups.at.omega**2 * freq_hz**ROAD_EXPONENT * stretched
    log_speed = 0.5 * np.log(speed.sum(axis=-1) * float(freq_hz[1] - freq_hz[0]))
    return np.asarray((log_road + log_speed).T)


def with_strokes(spectra: CrossSpectra, theta: F64, load: Load, ground: Ground) -> CrossSpectra:
    """The spectra with each axle's stroke speed relative to the usual one; unchanged if the reading has none."""
    usual_mps = spectra.reading.usual_stroke_mps
    if usual_mps is None:
        return spectra
    return replace(spectra, log_strokes=log_stroke_speeds(spectra, theta, load, ground) - np.log(usual_mps))
