"""The spectra of known-load drives, all read alike, each with its likelihood and its true load."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.likelihood import Point, Whittle
from gateway.core.cross_spectrum.measured import CrossSpectra, Reading, cross_spectra_of
from gateway.core.cross_spectrum.model.parameters import Ground
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64

BAND_HZ: Final = (1.1, 14.0)
N_SEGMENT: Final = 256
EVIDENCE_WEIGHT: Final = 0.2  # minutes of driving repeat the same model error; chosen, as docs/sensitivity.md shows


class KnownSpectra:
    """A run's spectra and likelihood with its true load."""

    def __init__(self, run: KnownRun, vehicle: Vehicle, spectra: CrossSpectra) -> None:
        ground = Ground.of(vehicle)
        self.run = run
        self.spectra = spectra
        self.whittle = Whittle(spectra, ground, EVIDENCE_WEIGHT)

    def at(self, theta: F64) -> Point:
        """The parameters theta (p,) with the run's load."""
        return Point.of(theta, self.run.load)


def known_spectra(runs: Sequence[KnownRun], vehicle: Vehicle) -> list[KnownSpectra]:
    """Those of ``runs`` that hold enough steady driving, their usual amplitude the median of all.

    Raises CalibrationImpossibleError where none does.
    """
    reading = Reading(vehicle.wheelbase_m, BAND_HZ, N_SEGMENT)
    read = [(run, spectra) for run in runs if (spectra := _spectra_of(run, reading)) is not None]
    if not read:
        raise CalibrationImpossibleError(
            "no run holds enough steady driving with both sensors for the cross-spectral estimator: drive at least a "
            "minute at speed, and map both"
        )
    usual = float(np.median([spectra.reading.usual_log_amplitude for _, spectra in read]))
    reading = replace(reading, usual_log_amplitude=usual)
    again = [(run, _spectra_of(run, reading)) for run, _ in read]
    return [KnownSpectra(run, vehicle, spectra) for run, spectra in again if spectra is not None]


def _spectra_of(run: KnownRun, reading: Reading) -> CrossSpectra | None:
    return cross_spectra_of([batch for batch in run.batches if not batch.rejected], reading)
