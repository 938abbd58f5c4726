"""Are the loads of a campaign those that were driven? Each statement is compared with what the other runs say.

A half-car is fitted to all runs as stated. Two runs are called swapped only if exchanging their loads explains all runs
far better. A single run is doubted if all runs are explained far better with its load free, the vehicle of the others
finds another load, and no deviation that a drive may have from its vehicle explains that. Evidence is the natural
logarithm of the factor by which the drives become more probable, at the calibration's own small weight of evidence.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Final

import numpy as np

from gateway.calibration.as_stated import StatedRun, fitted, stated_runs
from gateway.calibration.inspection.finding import Finding, Kind
from gateway.calibration.known_run import KnownRun
from gateway.core.reach import beyond
from gateway.core.vehicle import Load, Vehicle
from gateway.model import fit
from gateway.model.table import UPRIGHT, N, prior_of
from gateway.model.whittle import Point
from gateway.records import F64

SUSPICIOUS: Final = 5.0  # chosen: evidence against a statement, below which nothing is compared any further
LEAST_EVIDENCE: Final = 20.0  # chosen: of a swap, e^20
PAIRS_TRIED: Final = 4  # chosen: the likeliest pairs; each costs a fit
FEW_RUNS: Final = 4  # chosen: so few runs can bend the fit to wrong statements, so all pairs are tried
LEAST_OTHERS: Final = 3  # chosen: runs needed to weigh another one
DOUBT_EVIDENCE: Final = 16.0  # chosen: against one statement
DOUBT_STDS: Final = 4.0  # chosen: standard deviations of the others' estimate, which is wide where they extrapolate
DOUBT_PAYLOAD_SHARE: Final = 0.02  # chosen: of the empty mass; a smaller difference is not a wrong statement
DOUBT_FRONT_SHARE: Final = 0.01  # chosen: likewise of the front share (0..1)


def compare_loads(runs: Sequence[KnownRun], vehicle: Vehicle) -> Iterator[tuple[int, Finding]]:
    """Run numbers with findings about their loads: pairs that are swapped, and runs that the others contradict.

    The strongest explanation is set aside and the others are tested again: a wrong statement makes its neighbours look
    wrong too.
    """
    known = stated_runs(runs, vehicle)
    least = 2
    while len(known) >= least:
        compared = _Compared(known, vehicle)
        found = compared.swapped() or compared.doubted()
        if found is None:
            return
        yield from ((known[i].run.number, finding) for i, finding in found.items())
        known = [one for i, one in enumerate(known) if i not in found]
        least = LEAST_OTHERS


class _Compared:
    """Runs with their stated loads, and the half-car that explains them best."""

    def __init__(self, known: Sequence[StatedRun], vehicle: Vehicle) -> None:
        self.known, self.vehicle = list(known), vehicle
        mean, std = prior_of(UPRIGHT, vehicle)
        self._prior = fit.Gaussian.of(mean, np.diag(std**2))
        self._found = fitted(known, self._prior, mean)
        self._evidence = [self._evidence_against(one) for one in known]
        points = [Point.of(self._found.common, one.load) for one in known]
        self._costs = np.array([one.whittle.costs(points) for one in known])  # of run i with the load of run j

    def _evidence_against(self, one: StatedRun) -> float:
        """Gain in log probability of all drives if this run's load were free, with the vehicle fitted again.

        A score test asks it of the slopes at the statement, without another search: half of g' S^-1 g, with g the
        slope towards the load and S its information after the vehicle's parameters have moved along (C. R. Rao, Proc.
        Camb. Phil. Soc. 44, 1948).
        """
        here = one.whittle.curvature(Point.of(self._found.common, one.load), range(N + 2))
        slope, along = here.gradient[N:], here.information[N:, :N]
        information = here.information[N:, N:] - along @ self._found.covariance @ along.T
        return float(0.5 * slope @ np.linalg.solve(information, slope))

    def swapped(self) -> dict[int, Finding] | None:
        """The pair whose exchange explains the drives best, if one does by enough.

        If enough other runs remain to weigh both, these must agree: one wrong statement improves by many exchanges.
        """
        if max(self._evidence) < SUSPICIOUS:
            return None
        tried = {pair: self._found.cost - self._fitted(self._exchanged(*pair)).cost
                 for pair in self._likely_pairs()}  # fmt: skip
        for (i, j), evidence in sorted(tried.items(), key=lambda one: -one[1]):
            if evidence > LEAST_EVIDENCE and (said := self._confirmed(i, j)) is not None:
                text = (
                    f"exchanging the loads of runs {self.known[i].run.number} and {self.known[j].run.number} explains "
                )
                text += f"the drives better: evidence {evidence:.0f}, where {LEAST_EVIDENCE:g} is beyond doubt"
                return {one: Finding.of(Kind.LOADS_SWAPPED, text + by_others) for one, by_others in said.items()}
        return None

    def _likely_pairs(self) -> list[tuple[int, int]]:
        own = np.diag(self._costs)
        gains = own[:, None] + own[None, :] - self._costs - self._costs.T
        n = len(self.known)
        pairs = [(i, j) for i, j in combinations(range(n), 2) if self.known[i].load != self.known[j].load]
        pairs.sort(key=lambda pair: -gains[pair])
        return pairs if n <= FEW_RUNS else [pair for pair in pairs[:PAIRS_TRIED] if gains[pair] > 0.0]

    def _exchanged(self, i: int, j: int) -> list[StatedRun]:
        runs = list(self.known)
        runs[i], runs[j] = runs[i].saying(runs[j].load), runs[j].saying(runs[i].load)
        return runs

    def _confirmed(self, i: int, j: int) -> dict[int, str] | None:
        """What the other runs say of these two; None if they weigh one of them nearer to its own statement."""
        if len(self.known) - 2 < LEAST_OTHERS:
            return {i: "", j: ""}
        said = {}
        for one, other in ((i, j), (j, i)):
            weighed, _ = self._weighed(one, self._exchanged(i, j), (i, j))
            own, others = (beyond(weighed, [self.known[k].load], self.vehicle.empty_mass_kg) for k in (one, other))
            if own <= others:
                return None
            said[one] = f"; the other runs weigh this one at {_load(weighed)}, not {_load(self.known[one].load)}"
        return said

    def _weighed(self, i: int, runs: Sequence[StatedRun], free: Sequence[int]) -> tuple[Load, F64]:
        """Run i by the vehicle of the runs that are not ``free``, with the deviations (2,) of payload and share."""
        found = self._fitted(runs, free)
        payload_kg, share = found.own[i].tolist()
        return Load(payload_kg, 100.0 * share), np.sqrt(np.diag(found.own_covariances[i]))

    def _fitted(self, runs: Sequence[StatedRun], free: Sequence[int] = (), *, deviates: bool = False) -> fit.Found:
        return fitted(runs, self._prior, self._found.common, free, deviates=deviates)

    def doubted(self) -> dict[int, Finding] | None:
        """The run whose statement the others contradict most, if they contradict one."""
        if len(self.known) <= LEAST_OTHERS:
            return None
        for i in sorted(range(len(self.known)), key=lambda i: -self._evidence[i]):
            if self._evidence[i] < DOUBT_EVIDENCE:
                return None
            runs, stated = list(self.known), self.known[i].load
            runs[i] = runs[i].saying(self.known[int(np.argmin(self._costs[i]))].load)
            weighed, std = self._weighed(i, runs, (i,))
            off = np.abs(np.array([weighed.payload_kg - stated.payload_kg, weighed.front_share - stated.front_share]))
            allowed = np.array([DOUBT_PAYLOAD_SHARE * self.vehicle.empty_mass_kg, DOUBT_FRONT_SHARE])
            is_off = np.any((off > allowed) & (off > DOUBT_STDS * std))
            if is_off and self._is_beyond_a_day(i, runs):
                text = f"the other runs weigh this one at {_load(weighed)}, but the file states {_load(stated)}"
                return {i: Finding.of(Kind.LOAD_DISAGREES, text)}
        return None

    def _is_beyond_a_day(self, i: int, runs: Sequence[StatedRun]) -> bool:
        """Whether the doubt stays if every drive's vehicle deviates as vehicles do from day to day and load to load."""
        as_stated = self._fitted(self.known, deviates=True)
        return as_stated.cost - self._fitted(runs, (i,), deviates=True).cost > SUSPICIOUS


def _load(load: Load) -> str:
    return f"{load.payload_kg:.0f} kg with {load.front_share_pct:.1f} % in front"
