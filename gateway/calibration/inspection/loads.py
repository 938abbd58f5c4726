"""Are the loads of a campaign file those that were driven? Each run weighed by a calibration from the others.

A half-car is fitted to all runs as labelled. Two runs are called swapped only if exchanging their loads explains all
runs far better; a single run is doubted if all runs would be explained far better with its load free, and the others by
themselves find another weight. Evidence is the natural logarithm of the factor by which the drives become more
probable, at the calibration's own small weight of evidence.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Final

import numpy as np

from gateway.calibration.half_car.fit import half_car_calibration
from gateway.calibration.half_car.known_spectra import KnownSpectra, known_spectra
from gateway.calibration.half_car.most_probable_vehicle import fit_half_car
from gateway.calibration.half_car.prior import prior_of
from gateway.calibration.inspection.finding import Finding, Kind
from gateway.calibration.known_run import KnownRun
from gateway.core.cross_spectrum.likelihood import Point
from gateway.core.cross_spectrum.located import locate
from gateway.core.cross_spectrum.model.parameters import PARAMETERS
from gateway.core.cross_spectrum.search import Found
from gateway.core.reach import beyond
from gateway.core.vehicle import Load, Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64

LEAST_EVIDENCE: Final = 20.0  # chosen: of a swap, e^20
PAIRS_TRIED: Final = 4  # chosen: the likeliest pairs; each costs a fit
PAIRS_OF_FEW: Final = 2  # chosen: likewise with few runs
FEW_RUNS: Final = 4  # chosen: so few runs can bend the fit to wrong labels, so pairs are always tried
STRAINED_MISFIT: Final = 4.0  # chosen: 1 is perfect, true labels stayed below 3
LEAST_OTHERS: Final = 3  # chosen: runs needed to weigh another one
DOUBT_EVIDENCE: Final = 16.0
"""Of 84 sound runs of 14 simulated vans 3 exceed it (15 exceed 5, by 6.8 on average), and none of these lies beyond
DOUBT_STDS too, so fewer than one sound run in 28 is doubted (95 %). A label wrong by 60 kg reaches 18.
"""
DOUBT_STDS: Final = 4.0  # chosen: standard deviations of the others' estimate, which is wide where they extrapolate
DOUBT_PAYLOAD_SHARE: Final = 0.02  # chosen: of the empty mass; a smaller difference is not a wrong label
DOUBT_FRONT_SHARE: Final = 0.01  # chosen: likewise of the front share (0..1)


def compare_loads(runs: Sequence[KnownRun], vehicle: Vehicle) -> Iterator[tuple[int, Finding]]:
    """Run numbers with findings about their loads: pairs that are swapped, and runs that the others contradict.

    The strongest explanation is set aside and the others are tested again: a wrong label makes its neighbours look
    wrong too.
    """
    try:
        known = known_spectra(runs, vehicle)
    except CalibrationImpossibleError:
        return
    least = 2
    while len(known) >= least:
        labelled = _Labelled(known, vehicle)
        aside: tuple[int, ...]
        if (swapped := labelled.swapped_pair()) is not None:
            yield from _swap_findings(labelled, *swapped)
            aside = swapped[:2]
        elif (doubted := labelled.doubted()) is not None:
            yield _disagreement(labelled, *doubted)
            aside = doubted[:1]
        else:
            return
        known = [one for n, one in enumerate(known) if n not in aside]
        least = LEAST_OTHERS


class _Labelled:
    """Runs with the loads that the campaign file gives them, and the half-car that explains them best."""

    def __init__(self, known: Sequence[KnownSpectra], vehicle: Vehicle) -> None:
        self.known = known
        self.vehicle = vehicle
        self._prior = prior_of(vehicle)
        self.fitted = fit_half_car(known, self._prior, self._prior.start(0.0, 0.0))

    def costs(self) -> F64:
        """(n, n) cost of run i with the load of run j."""
        points = [k.at(self.fitted.x) for k in self.known]
        return np.array([[k.whittle.cost(point) for point in points] for k in self.known])

    def swapped_pair(self) -> tuple[int, int, float] | None:
        """The pair whose exchange explains the drives best, with its evidence; None if none does by enough.

        If enough other runs remain to weigh both, these must agree: one wrong label improves by many exchanges.
        """
        costs = self.costs()
        own = np.diag(costs)
        gains = own[:, None] + own[None, :] - costs - costs.T
        pairs = [pair for pair in combinations(range(len(self.known)), 2) if self._differ(*pair)]
        pairs.sort(key=lambda pair: -gains[pair])
        if len(self.known) > FEW_RUNS:
            likely = [pair for pair in pairs[:PAIRS_TRIED] if gains[pair] > 0.0]
        else:
            likely = pairs if self._is_strained() else pairs[:PAIRS_OF_FEW]
        tried = [(i, j, self.fitted.cost - self._with_exchanged(i, j).cost) for i, j in likely]
        evident = sorted((one for one in tried if one[2] > LEAST_EVIDENCE), key=lambda one: -one[2])
        return next((one for one in evident if self._is_confirmed(one[0], one[1])), None)

    def _is_confirmed(self, i: int, j: int) -> bool:
        """False if the other runs weigh one of them nearer to its own label than to the other's."""
        if len(self.known) - 2 < LEAST_OTHERS:
            return True
        return all(self._is_nearer(one, other, (i, j)) for one, other in ((i, j), (j, i)))

    def _is_nearer(self, one: int, other: int, left_out: Sequence[int]) -> bool:
        point, _ = self.weighed_by_others(one, left_out)
        own, exchanged = (
            beyond(point.load, [run.load], self.vehicle.empty_mass_kg)
            for run in (self.known[one].run, self.known[other].run)
        )
        return exchanged < own

    def _is_strained(self) -> bool:
        """True if no half-car explains some run with its label."""
        return any(k.whittle.misfit(k.at(self.fitted.x)) > STRAINED_MISFIT for k in self.known)

    def doubted(self) -> tuple[int, Point] | None:
        """The run whose load the others contradict most, and the weight they find; None if they contradict none."""
        if len(self.known) <= LEAST_OTHERS:
            return None
        evidence = [self._evidence_against(k) for k in self.known]
        likely = sorted(np.flatnonzero(np.array(evidence) > DOUBT_EVIDENCE).tolist(), key=lambda i: -evidence[i])
        for i in likely:
            point, std = self.weighed_by_others(i, (i,))
            if self._is_off(i, point, std):
                return i, point
        return None

    def _evidence_against(self, one: KnownSpectra) -> float:
        """Gain in log probability of all drives if this run's load were free, with the vehicle fitted again.

        A score test asks it of the slopes at the labels, without another search: half of g' S^-1 g, with g the
        slope towards the load and S its information after the vehicle's parameters have moved along
        (C. R. Rao, Proc. Camb. Phil. Soc. 44, 1948).
        """
        here = one.whittle.curvature(one.at(self.fitted.x), list(range(len(PARAMETERS) + 2)))
        slope, along = here.gradient[-2:], here.information[-2:, :-2]
        information = here.information[-2:, -2:] - along @ self.fitted.covariance @ along.T
        return float(0.5 * slope @ np.linalg.solve(information, slope))

    def _is_off(self, i: int, weighed: Point, std: F64) -> bool:
        run = self.known[i].run
        off = np.abs([weighed.payload_kg - run.payload_kg, weighed.front_share - run.load.front_share])
        allowed = [DOUBT_PAYLOAD_SHARE * self.vehicle.empty_mass_kg, DOUBT_FRONT_SHARE]
        return bool(np.any((off > allowed) & (off > DOUBT_STDS * std)))

    def _differ(self, i: int, j: int) -> bool:
        return self.known[i].run.load != self.known[j].run.load

    def _with_exchanged(self, i: int, j: int) -> Found:
        one, other = self.known[i], self.known[j]
        runs = list(self.known)
        runs[i], runs[j] = self._carrying(one, other.run), self._carrying(other, one.run)
        return fit_half_car(runs, self._prior, self.fitted.x)

    def _carrying(self, one: KnownSpectra, other: KnownRun) -> KnownSpectra:
        run = replace(one.run, payload_kg=other.payload_kg, front_share_pct=other.front_share_pct)
        return KnownSpectra(run, self.vehicle, one.spectra)

    def weighed_by_others(self, i: int, left_out: Sequence[int]) -> tuple[Point, F64]:
        """Run i by a half-car that has not seen the runs left out: the load, and its (payload, share) deviations."""
        others = [k for n, k in enumerate(self.known) if n not in left_out]
        refitted = fit_half_car(others, self._prior, self._prior.start(0.0, 0.0))  # the fit of all knows the label
        calibration = half_car_calibration(others, self.vehicle, refitted)
        located = locate(self.known[i].spectra, calibration)
        by_calibration = located.moves @ calibration.covariance @ located.moves.T
        return located.point, np.sqrt(np.diag(located.own + located.rival_covariance + by_calibration))


def _swap_findings(all_runs: _Labelled, i: int, j: int, evidence: float) -> Iterator[tuple[int, Finding]]:
    runs = {n: all_runs.known[n].run for n in (i, j)}
    text = f"exchanging the loads of runs {runs[i].number} and {runs[j].number} explains the drives better: evidence "
    text += f"{evidence:.0f}, where {LEAST_EVIDENCE:g} is beyond doubt"
    for n, run in runs.items():
        others = ""
        if len(all_runs.known) - 2 >= LEAST_OTHERS:
            point, _ = all_runs.weighed_by_others(n, (i, j))
            others = f"; the other runs weigh this one at {_load(point.load)}, not {_load(run.load)}"
        yield run.number, Finding.of(Kind.LOADS_SWAPPED, text + others)


def _disagreement(all_runs: _Labelled, i: int, weighed: Point) -> tuple[int, Finding]:
    run = all_runs.known[i].run
    text = f"the other runs weigh this one at {_load(weighed.load)}, but the file states {_load(run.load)}"
    return run.number, Finding.of(Kind.LOAD_DISAGREES, text)


def _load(load: Load) -> str:
    return f"{load.payload_kg:.0f} kg with {load.front_share_pct:.1f} % in front"
