"""The spectra of known-load drives, all read alike, each with its likelihood and its true load."""

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.calibration.inheritance import Usual
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.lateral import ROLL_BAND_HZ
from gateway.core.cross_spectrum.likelihood import EVIDENCE_WEIGHT, Point, Whittle
from gateway.core.cross_spectrum.measured import CrossSpectra, Segments, grouped, segments_of
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS, Ground, level, mount_of
from gateway.core.cross_spectrum.model.reading import Reading
from gateway.core.cross_spectrum.model.strokes import log_stroke_speeds, with_strokes
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64

BAND_HZ: Final = (1.1, 14.0)  # chosen: body and wheel resonances
N_SEGMENT: Final = 256  # chosen: 5 s at 50 Hz, short enough for town traffic
LEAST_MOMENT_STD_KGM: Final = 0.5  # chosen: about the centre line, also of an empty vehicle with its loose items


class KnownSpectra:
    """A run's spectra and likelihood with its true load.

    ``whittle`` is of vertical acceleration and pitch rate. With a roll rate, ``rolling`` is of all three sensors,
    :meth:`brought` makes ``whittle`` that of a sensor on the centre line, from the ``segments``, and :meth:`stroking`
    makes friction depend on each axle's stroke speed.
    """

    def __init__(
        self, run: KnownRun, vehicle: Vehicle, spectra: CrossSpectra, segments: Segments | None = None
    ) -> None:
        self.run = run
        self.spectra = spectra
        self._segments = segments
        self._vehicle = vehicle
        self._roll: F64 = np.empty(0)
        self.whittle = self._whittle(spectra.without_roll)

    @property
    def rolling(self) -> Whittle:
        """Of all three sensors as measured."""
        return self._whittle(self.spectra.within(ROLL_BAND_HZ))

    def brought(self, theta: F64) -> "KnownSpectra":
        """The same run seen from the centre line, with the sensor at its place in theta (n,) of a vehicle that
        rolls.
        """
        one = copy(self)
        if self._segments is not None:
            spectra = grouped(self._segments, replace(self.spectra.reading, mount=mount_of(theta)))
            one.whittle = self._whittle(spectra.without_roll)
        one._roll = level(theta)[len(PARAMETERS) :]
        return one

    def stroking(self, theta: F64, usual_mps: tuple[float, float]) -> "KnownSpectra":
        """The same run with the axles' stroke speeds relative to the usual ones, by a half-car theta (p,)."""

        def told(spectra: CrossSpectra) -> CrossSpectra:
            usual = replace(spectra, reading=replace(spectra.reading, usual_stroke_mps=usual_mps))
            return with_strokes(usual, theta, self.run.load, self.whittle.ground)

        one = copy(self)
        one.spectra, one.whittle = told(self.spectra), self._whittle(told(self.whittle.spectra))
        return one

    def log_stroke_speeds(self, theta: F64) -> F64:
        """(2,) logarithm of the stroke speed (m/s) of front and rear axle of a half-car theta (p,), over all
        segments.
        """
        spectra = self.whittle.spectra
        every = log_stroke_speeds(spectra, theta, self.run.load, self.whittle.ground)
        return np.asarray(np.average(every, axis=0, weights=spectra.n_segments[:, 0]), float)

    def at(self, theta: F64) -> Point:
        """The half-car's parameters theta (p,) with the run's load at its stated position."""
        if self.run.payload_left_m and len(self._roll):
            return self.placed(np.r_[theta, self._roll], 0.0)
        return Point.of(theta, self.run.load)

    def placed(self, theta: F64, moment_off_kgm: float) -> Point:
        """All parameters theta (n,) of a vehicle that rolls, with this error of the payload's moment about the centre
        line.
        """
        moment_kgm = self.run.payload_kg * (self.run.payload_left_m or 0.0) + moment_off_kgm
        cg_left_m = self.empty_share * float(theta[INDEX["empty_left_m"]]) + moment_kgm / self.total_kg
        return Point.of(theta, self.run.load, cg_left_m)

    @property
    def moment_std_kgm(self) -> float:
        """Precision of the payload's moment about the centre line."""
        return self.run.payload_kg * self.run.payload_left_std_m + LEAST_MOMENT_STD_KGM

    @property
    def total_kg(self) -> float:
        """Of the total sprung mass."""
        return self._vehicle.empty_mass_kg + self.run.payload_kg

    @property
    def empty_share(self) -> float:
        """Of it, the empty vehicle's."""
        return self._vehicle.empty_mass_kg / self.total_kg

    def _whittle(self, spectra: CrossSpectra) -> Whittle:
        return Whittle(spectra, Ground.of(self._vehicle, with_roll=self.spectra.roll is not None), EVIDENCE_WEIGHT)


def known_spectra(
    runs: Sequence[KnownRun], vehicle: Vehicle, *, with_roll: bool = False, usual: Usual | None = None
) -> list[KnownSpectra]:
    """The spectra of the ``runs`` with enough steady driving, their usual amplitude the median of all unless given.

    ``with_roll`` reads the roll rate too, if every run has one. Raises CalibrationImpossibleError if no run has enough.
    """
    reading = Reading(vehicle.wheelbase_m, BAND_HZ, N_SEGMENT, with_roll=with_roll)
    read = _read(runs, reading)
    if not read:
        raise CalibrationImpossibleError(
            "no run has enough steady driving with both sensors for the cross-spectral estimator: drive at least a "
            "minute at speed, and map both"
        )
    if usual is None:
        usual = Usual(
            float(np.median([grouped(segments, reading).reading.usual_log_amplitude for _, segments in read]))
        )
    if with_roll and any(len(segments.sensed) < 3 for _, segments in read):
        with_roll, reading = False, replace(reading, with_roll=False)
        read = _read([run for run, _ in read], reading)
    reading = replace(
        reading,
        usual_log_amplitude=usual.log_amplitude,
        usual_stroke_mps=usual.stroke_mps if with_roll else None,
    )
    return [KnownSpectra(run, vehicle, grouped(segments, reading), segments) for run, segments in read]


def _read(runs: Sequence[KnownRun], reading: Reading) -> list[tuple[KnownRun, Segments]]:
    """Those of the runs with enough segments."""
    read = [(run, segments_of([batch for batch in run.batches if not batch.rejected], reading)) for run in runs]
    return [(run, segments) for run, segments in read if segments is not None]
