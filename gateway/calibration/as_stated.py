"""The half-car that explains drives best if every load is what was stated of it; the load of some may be left free.

A fit takes a second: it compares statements, and calibrates nothing.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from typing import Final

import numpy as np

from gateway.calibration.known_run import KnownRun
from gateway.calibration.read_drive import EVIDENCE
from gateway.calibration.teach import BAND_HZ, N_SEGMENT
from gateway.core.vehicle import Load, Vehicle
from gateway.model import fit
from gateway.model.car import Ground
from gateway.model.spectra import CrossSpectra, Reading, grouped, segments_of
from gateway.model.table import N_OWN, OWN, UPRIGHT, N, covariance_of, of_drive
from gateway.model.weigh import MOST_LOAD_SHARE
from gateway.model.whittle import Point, Whittle
from gateway.records import F64

TOLERANCE: Final = 0.1  # chosen: in log posterior
_DEVIATES: Final = np.linalg.inv(covariance_of([UPRIGHT[i] for i in OWN], "day", "load", "batch"))


@dataclass(frozen=True, slots=True, eq=False)
class StatedRun:
    """The likelihood of one drive, by the vehicle (N,) and by what is the drive's own: the deviations (N_OWN,) from
    that vehicle, then payload (kg) and front share (0..1); each may be left out.
    """

    run: KnownRun
    load: Load
    whittle: Whittle

    def point(self, common: F64, own: F64) -> Point:
        """The vehicle of this drive with its own load, or with the stated one."""
        deviations, load = _split(own)
        theta = of_drive(common, deviations)
        return Point(theta, float(load[0]), float(load[1])) if len(load) else Point.of(theta, self.load)

    def cost(self, common: F64, own: F64) -> float:
        """See gateway.model.fit."""
        point = self.point(common, own)
        most_kg = MOST_LOAD_SHARE * self.whittle.ground.empty_mass_kg
        return (
            self.whittle.cost(point) if abs(point.payload_kg) < most_kg and 0.05 < point.front_share < 0.95 else np.inf
        )

    def curvature(self, common: F64, own: F64) -> tuple[F64, F64]:
        """See gateway.model.fit."""
        deviations, load = _split(own)
        n = N + len(load)
        chosen = [*range(N), *(OWN if len(deviations) else ()), *range(N, n)]
        found = self.whittle.curvature(self.point(common, own), range(n))
        return found.gradient[chosen], found.information[np.ix_(chosen, chosen)]

    def saying(self, load: Load) -> "StatedRun":
        """The same drive with another statement."""
        return replace(self, load=load)

    def own(self, *, deviates: bool, is_free: bool) -> fit.Drive:
        """The drive in a fit, with what is its own."""
        n = N_OWN * deviates + 2 * is_free
        precision, start = np.zeros((n, n)), np.zeros(n)
        if deviates:
            precision[:N_OWN, :N_OWN] = _DEVIATES
        if is_free:
            start[-2:] = self.load.payload_kg, self.load.front_share
        return fit.Drive(self, fit.Gaussian(np.zeros(n), precision), start)


def _split(own: F64) -> tuple[F64, F64]:
    """A drive's own vector: its deviations (N_OWN,) or (0,), and its load (2,) or (0,)."""
    n = N_OWN if len(own) >= N_OWN else 0
    return own[:n], own[n:]


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


def fitted(
    runs: Sequence[StatedRun], prior: fit.Gaussian, start: F64, free: Collection[int] = (), *, deviates: bool = False
) -> fit.Found:
    """The most probable vehicle (N,) from ``start``, the loads of the runs ``free`` (by place) being unknown.
    ``deviates``: each drive's vehicle differs from it as the table of parameters says.
    """
    drives = [one.own(deviates=deviates, is_free=i in free) for i, one in enumerate(runs)]
    return fit.most_probable(start, prior, drives, TOLERANCE)
