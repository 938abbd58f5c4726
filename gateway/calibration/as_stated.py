"""The half-car that explains drives best if every load is what was stated of it.

A fit takes a second: it compares statements, and calibrates nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gateway.calibration.read_drive import EVIDENCE
from gateway.calibration.stated_drive import StatedDrive
from gateway.core.vehicle import Load, Vehicle
from gateway.model import fit
from gateway.model.car import Ground
from gateway.model.mixture import MOST_LOAD_SHARE
from gateway.model.spectra import CrossSpectra, Reading, grouped, segments_of
from gateway.model.table import N
from gateway.model.whittle import Point, Whittle
from gateway.records import F64

TOLERANCE: Final = 0.1  # chosen: in log posterior


@dataclass(frozen=True, slots=True, eq=False)
class StatedRun:
    """The likelihood of one drive by its vehicle (N,), its load being what was stated."""

    load: Load
    whittle: Whittle

    def cost(self, common: F64, own: F64) -> float:
        """See gateway.model.fit."""
        most_kg = MOST_LOAD_SHARE * self.whittle.ground.empty_mass_kg
        if abs(self.load.payload_kg) >= most_kg or not 0.05 < self.load.front_share < 0.95:
            return np.inf
        return self.whittle.cost(Point.of(common, self.load))

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        """See gateway.model.fit."""
        found = self.whittle.curvature(Point.of(common, self.load), range(N))
        return found.gradient, found.information


def stated_load(run: StatedDrive, vehicle: Vehicle) -> Load:
    """The load of a run; none if nobody stated its payload and place."""
    return run.load if run.is_known else Load(0.0, vehicle.empty_front_share_pct)


def stated_run(run: StatedDrive, spectra: CrossSpectra, vehicle: Vehicle) -> StatedRun:
    """The likelihood of one drive; without the roll rate, which a known mount has removed from the other spectra."""
    ground = Ground.of(vehicle, with_roll=spectra.has_roll and spectra.reading.mount is not None)
    return StatedRun(stated_load(run, vehicle), Whittle(spectra.without_roll, ground, EVIDENCE))


def stated_runs(runs: Sequence[StatedDrive], vehicle: Vehicle, reading: Reading) -> list[StatedRun]:
    """The runs whose load is stated, with enough steady driving."""
    stated = [run for run in runs if run.is_known]
    each = [(run, segments_of([b for b in run.batches if not b.rejected], reading)) for run in stated]
    return [stated_run(run, grouped(segments, reading), vehicle) for run, segments in each if segments is not None]


def fitted(runs: Sequence[StatedRun], prior: fit.Gaussian, start: F64) -> fit.Found:
    """The most probable vehicle (N,) from ``start``."""
    return fit.most_probable(start, prior, [fit.Drive(one, fit.NOTHING, np.empty(0)) for one in runs], TOLERANCE)
