"""What driving on, or saying more, would gain: the accuracy of drives that have not been driven.

    ahead = Ahead(model, vehicle)
    ahead.stds(model.covariance)     of payload and front share, now
    next_steps(model, vehicle)       after each of CANDIDATES, the most useful first

An ideal drive shows exactly the model's spectra. A further one with information I makes the covariance C of the
vehicle's parameters (C^-1 + I)^-1, with which another ideal drive is weighed. It is a prediction of the model to first
order: errors of the model itself enter as calibration states them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import sqrt
from typing import Final

import numpy as np

from gateway.calibration.fit_of_drives import information_of
from gateway.calibration.statements import KNOWN_PLUS_MINUS_KG, Statement, empty
from gateway.core.cargo import shape_hypotheses
from gateway.core.spectrum import frequencies_hz
from gateway.core.vehicle import Load, Vehicle, front_share_pct
from gateway.estimates.quantity import Z95
from gateway.model.answer import posterior_of
from gateway.model.mixture import mixture_of
from gateway.model.sensors import GAIN_STD
from gateway.model.spectra import CrossSpectra, Reading, level
from gateway.model.table import N
from gateway.model.vehicle_model import VehicleModel
from gateway.model.whittle import Point, Whittle
from gateway.records import F64
from gateway.stated.statement import StatementSource

RATE_HZ: Final = 50.0  # of the grid, BatchSettings.rate_hz
BATCH_S: Final = 300.0  # BatchSettings.window_s
DRIVE_S: Final = 900.0  # chosen: of a candidate; a quarter of an hour is what campaigns ask for
REFERENCE: Final = (0.5, 0.6)  # chosen: part of the largest payload, and its place in wheelbases


def steady_drive(model: VehicleModel, load: Load, duration_s: float, speed_mps: float) -> CrossSpectra:
    """The spectra that the model expects of a drive at one speed, seen from the centre line."""
    reading: Reading = model.reading
    theta = level(model.parameters) if model.has_roll else model.parameters
    every_hz = frequencies_hz(reading.n_segment, RATE_HZ)
    step_hz, (low_hz, high_hz) = every_hz[1], reading.band_hz
    freq_hz = every_hz[(every_hz >= low_hz - step_hz) & (every_hz <= high_hz + step_hz)]
    delay_s = reading.wheelbase_m / speed_mps
    frame = CrossSpectra(
        freq_hz=freq_hz,
        parts=np.ones((9 if model.has_roll else 4, 1, len(freq_hz) - 2)),
        delay_phase=np.exp(-2j * np.pi * freq_hz * delay_s)[None],
        delay_s=np.array([[delay_s]]),
        n_segments=np.array([[max(1.0, np.floor(2.0 * duration_s * RATE_HZ / reading.n_segment) - 1.0)]]),
        inverse_power=np.zeros((1, 1)),
        log_amplitude=np.zeros((1, 1)),
        acceleration_rms_mps2=model.acceleration_rms_mps2,
        pitch_rate_rms_radps=model.pitch_rate_rms_radps,
        reading=reading,
    )
    return frame.showing(Whittle(frame, model.ground).expected(Point.of(theta, load)))


class Ahead:
    """A batch of the reference load, which the vehicle has not carried yet."""

    def __init__(self, model: VehicleModel, vehicle: Vehicle) -> None:
        self._model, self._vehicle = model, vehicle
        self.speed_mps = float(np.mean(model.speed_seen_mps))
        self._batch = steady_drive(model, _placed(vehicle, *REFERENCE), BATCH_S, self.speed_mps)

    def stds(self, covariance: F64) -> tuple[float, float]:
        """Standard deviations of payload (kg) and front share (%), with this covariance (n, n) of the vehicle's
        parameters.
        """
        model = replace(self._model, covariance=covariance, directions=np.zeros((len(covariance), 0)))
        shapes = shape_hypotheses(self._vehicle, *model.known_shape)
        posterior = posterior_of(mixture_of(self._batch, model, shapes), model, 1.0, GAIN_STD)
        payload_var, share_var, *_ = np.diag(posterior.covariance).tolist()
        return sqrt(payload_var), sqrt(share_var)

    def after(
        self, statement: Statement, load: Load, duration_s: float = DRIVE_S, speed_mps: float | None = None
    ) -> F64:
        """Covariance (n, n) of the parameters after one more drive with this load and ``statement``.

        The roll parameters keep theirs.
        """
        model = self._model
        spectra = steady_drive(model, load, duration_s, speed_mps or self.speed_mps).without_roll
        point = Point.of(model.parameters[:N], load)
        told = information_of(spectra, point, model.ground, statement, self._vehicle)
        covariance = model.covariance.copy()
        covariance[:N, :N] = np.linalg.inv(np.linalg.inv(covariance[:N, :N]) + told)
        covariance[N:, :N] = covariance[:N, N:] = 0.0
        return covariance


def _placed(vehicle: Vehicle, part: float, place: float) -> Load:
    """A part of the largest payload at a place in wheelbases behind the front axle."""
    payload_kg = part * vehicle.largest_payload_kg
    return Load(payload_kg, front_share_pct(vehicle, payload_kg, place * vehicle.wheelbase_m))


def _said(load: Load, source: StatementSource, plus_minus_kg: float) -> Statement:
    return Statement(source=source, payload_kg=load.payload_kg, payload_plus_minus_kg=plus_minus_kg)


def _note(load: Load) -> Statement:
    return _said(load, StatementSource.DELIVERY_NOTE, max(0.05 * load.payload_kg, 10.0))


def _scale(load: Load) -> Statement:
    return _said(load, StatementSource.SCALE, 12.0)


def _axle_scales(load: Load) -> Statement:
    said = _said(load, StatementSource.AXLE_SCALES, 12.0)
    return replace(said, front_share_pct=load.front_share_pct, front_share_plus_minus_pct=0.7)


def _known(load: Load) -> Statement:
    said = _said(load, StatementSource.KNOWN, KNOWN_PLUS_MINUS_KG)
    return replace(said, front_share_pct=load.front_share_pct, is_compact=True)


@dataclass(frozen=True, slots=True)
class Candidate:
    """Something to drive or to state: its load as part of the largest payload, and the speed over the usual one."""

    name: str
    words: str
    statement: Callable[[Load], Statement]
    part: float
    place: float = 0.5
    speed_ratio: float = 1.0


# Chosen: what people can do. Plus-minus of scales is that of a weighbridge with steps of 20 kg.
CANDIDATES: Final = (
    Candidate("empty_drive", "another empty drive", lambda load: empty(), 0.0),
    Candidate("another_speed", "an empty drive at another speed", lambda load: empty(), 0.0, speed_ratio=1.6),
    Candidate("delivery_note", "the delivery note of a drive with a large load", _note, 0.8),
    Candidate("scale", "a large load on a weighbridge", _scale, 0.8),
    Candidate("axle_scales", "a large load on a weighbridge, axle by axle", _axle_scales, 0.8),
    Candidate("known_load_front", "a known load behind the front seats", _known, 0.8, 0.3),
    Candidate("known_load_rear", "a known load over the rear axle", _known, 0.8, 0.95),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Step:
    """A candidate, with half the 95 % interval of the reference payload now and after it."""

    candidate: Candidate
    now_kg: float
    then_kg: float

    @property
    def text(self) -> str:
        """In words."""
        return (
            f"{self.candidate.words} would narrow the 95 % interval of a middling payload most: from ± "
            f"{self.now_kg:.0f} to ± {self.then_kg:.0f} kg"
        )


def next_steps(model: VehicleModel, vehicle: Vehicle) -> tuple[Step, ...]:
    """What each of CANDIDATES would gain, the most useful first."""
    ahead = Ahead(model, vehicle)
    now_kg = Z95 * ahead.stds(model.covariance)[0]
    steps = []
    for one in CANDIDATES:
        load = _placed(vehicle, one.part, one.place)
        covariance = ahead.after(one.statement(load), load, speed_mps=one.speed_ratio * ahead.speed_mps)
        steps.append(Step(one, now_kg, Z95 * ahead.stds(covariance)[0]))
    return tuple(sorted(steps, key=lambda step: step.then_kg))
