"""The half-car that explains drives best if every load is what was stated of it; the load of some may be left free.

No drive deviates from its vehicle here, so a fit takes a second: it compares statements, and calibrates nothing.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Final

import numpy as np

from gateway.calibration.known_run import KnownRun
from gateway.calibration.vehicle import BAND_HZ, EVIDENCE, MOST_LOAD_SHARE, N_SEGMENT
from gateway.core.vehicle import Load, Vehicle
from gateway.model import fit
from gateway.model.car import Ground
from gateway.model.spectra import CrossSpectra, Reading, grouped, segments_of
from gateway.model.table import N
from gateway.model.whittle import Point, Whittle
from gateway.records import F64

TOLERANCE: Final = 0.1  # chosen: in log posterior
FREE: Final = fit.Gaussian(np.zeros(2), np.zeros((2, 2)))
"""The prior of a free load: none."""


@dataclass(frozen=True, slots=True, eq=False)
class StatedRun:
    """The likelihood of one drive, by the vehicle (N,) and, if free, by payload (kg) and front share (0..1)."""

    run: KnownRun
    load: Load
    whittle: Whittle

    def point(self, theta: F64, own: F64) -> Point:
        """The vehicle with the free load, or with the stated one."""
        return Point(theta, float(own[0]), float(own[1])) if len(own) else Point.of(theta, self.load)

    def cost(self, common: F64, own: F64) -> float:
        """See gateway.model.fit."""
        if len(own) and not (
            abs(own[0]) < MOST_LOAD_SHARE * self.whittle.ground.empty_mass_kg and 0.05 < own[1] < 0.95
        ):
            return np.inf
        return self.whittle.cost(self.point(common, own))

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        """See gateway.model.fit."""
        found = self.whittle.curvature(self.point(common, own), range(N + len(own)))
        return found.gradient, found.information

    def saying(self, load: Load) -> "StatedRun":
        """The same drive with another statement."""
        return replace(self, load=load)


def stated_load(run: KnownRun, vehicle: Vehicle) -> Load:
    """The load of a run; none if nobody stated its payload and place."""
    is_stated = isfinite(run.payload_kg) and isfinite(run.front_share_pct)
    return run.load if is_stated else Load(0.0, vehicle.empty_front_share_pct)


def stated_run(run: KnownRun, spectra: CrossSpectra, vehicle: Vehicle) -> StatedRun:
    """One drive with its spectra; without the roll rate, which a known mount has removed from the others."""
    ground = Ground.of(vehicle, with_roll=spectra.has_roll and spectra.reading.mount is not None)
    return StatedRun(run, stated_load(run, vehicle), Whittle(spectra.without_roll, ground, EVIDENCE))


def stated_runs(runs: Sequence[KnownRun], vehicle: Vehicle, reading: Reading | None = None) -> list[StatedRun]:
    """Those whose load is stated, with enough steady driving. Without a ``reading`` the usual amplitude is their
    median.
    """
    first = reading or Reading(vehicle.wheelbase_m, BAND_HZ, N_SEGMENT)
    stated = [run for run in runs if isfinite(run.payload_kg) and isfinite(run.front_share_pct)]
    each = [(run, segments_of([b for b in run.batches if not b.rejected], first)) for run in stated]
    known = [(run, segments) for run, segments in each if segments is not None]
    if reading is None and known:
        usual = [grouped(segments, first).reading.usual_log_amplitude for _, segments in known]
        first = replace(first, usual_log_amplitude=float(np.median(np.array(usual, float))))
    return [stated_run(run, grouped(segments, first), vehicle) for run, segments in known]


def fitted(runs: Sequence[StatedRun], prior: fit.Gaussian, start: F64, free: Collection[int] = ()) -> fit.Found:
    """The most probable vehicle (N,) from ``start``, the loads of the runs ``free`` (by place) being unknown."""
    drives = [
        fit.Drive(one, FREE, np.array([one.load.payload_kg, one.load.front_share]))
        if i in free
        else fit.Drive(one, fit.NOTHING, fit.NOTHING.mean)
        for i, one in enumerate(runs)
    ]
    return fit.most_probable(start, prior, drives, TOLERANCE)
