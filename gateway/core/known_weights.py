"""Known weights (an empty vehicle, a weighbridge ticket, a delivery note) condition the sources of error.

    knowledge = Knowledge.of(observations, now_ns)
    known = knowledge.applied(posterior, t_ns)

The error of an estimate is its own error plus the columns of its sources times their unknown z ~ N(0, I)
(gateway.posterior). With a known load the error of the estimate is known except for its own part, which conditions z: a
Kalman update (R. E. Kalman, J. Basic Eng. 82, 1960). Every later estimate then becomes

    mean + S E[z],    own + S Cov[z] S'

Knowledge of the daily sources (temperature, wear) decays. Errors that last for one load are part of the observation's
noise. The state is always recomputed from the list of observations, so that removing one restores the earlier numbers
exactly.
"""

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np

from gateway.posterior import ONE_LOAD, PAYLOAD, Posterior, Source
from gateway.records import F64
from gateway.units import NS_PER_S

DAY_MEMORY_S: Final = 3.0 * 86_400.0  # chosen: time in which knowledge of the daily sources decays to 1/e
CONTRADICTED: Final = (
    3.0  # chosen: standard deviations between a known weight and its estimate beyond which a person must confirm it
)


class KnownWeightKind(StrEnum):
    """How the load became known."""

    EMPTY = "empty"
    TICKET = "ticket"
    AXLE_PADS = "axle_pads"
    DELIVERY_NOTE = "delivery_note"


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """A known load: the posterior as measured, and the true payload (kg) and front share (%), the payload alone or
    both, with the covariance (k, k) of their errors. It belongs to one calibration and one estimator.
    """

    id: str
    t_ns: int
    calibration_id: str
    estimator: str
    posterior: Posterior
    truth: F64
    truth_covariance: F64

    @property
    def off(self) -> F64:
        """(k,) estimate minus truth."""
        return self.posterior.mean[: len(self.truth)] - self.truth

    @property
    def distance(self) -> float:
        """Distance of the known payload from its estimate, in standard deviations of both errors."""
        variance = float(self.posterior.covariance[PAYLOAD, PAYLOAD] + self.truth_covariance[PAYLOAD, PAYLOAD])
        return abs(float(self.off[PAYLOAD])) / math.sqrt(variance)

    @property
    def is_contradicted(self) -> bool:
        """True if the estimate contradicts the known weight."""
        return self.distance > CONTRADICTED


_LASTING: Final = tuple(name for name in Source if name not in ONE_LOAD)


@dataclass(frozen=True, slots=True, eq=False)
class Knowledge:
    """E[z] (n,) and Cov[z] (n, n) of the sources that outlast a load, after the last observation at t_ns.

    ``slots`` maps each source to its columns. ``id`` is the hash of the observations.
    """

    id: str
    calibration_id: str
    estimator: str
    slots: Mapping[Source, slice]
    mean: F64
    covariance: F64
    t_ns: int

    @classmethod
    def of(cls, observations: Sequence[Observation]) -> "Knowledge | None":
        """The knowledge from these observations, in order of time; None if there are none.

        Raises ValueError if they are of several calibrations or estimators.
        """
        observations = sorted(observations, key=lambda one: (one.t_ns, one.id))
        if not observations:
            return None
        if len({(one.calibration_id, one.estimator) for one in observations}) > 1:
            raise ValueError("known weights of several calibrations cannot be taken together")
        slots = _slots(observations)
        n = max((each.stop for each in slots.values()), default=0)
        digest = hashlib.sha256("|".join(one.id for one in observations).encode()).hexdigest()
        first = observations[0]
        known = cls(digest[:16], first.calibration_id, first.estimator, slots, np.zeros(n), np.eye(n), first.t_ns)
        for one in observations:
            known = known._at(one.t_ns)._having_seen(one)
        return known

    def is_for(self, calibration_id: str | None, estimator: str) -> bool:
        """Whether it applies to estimates of this calibration and estimator."""
        return (self.calibration_id, self.estimator) == (calibration_id, estimator)

    def applied(self, posterior: Posterior, t_ns: int) -> Posterior:
        """``posterior`` of a batch at t_ns, conditioned on what is known of its sources.

        Columns of lasting sources become R S with R R = Cov[z], so that they still stand for causes that all batches
        share. R is the symmetric root, the closest to the identity, so that each column keeps most of its own source.
        """
        now = self._at(t_ns)
        columns = now._columns(posterior)
        values, vectors = np.linalg.eigh(now.covariance)
        learned = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T @ columns
        known = {}
        for name, place in self.slots.items():
            never_seen = posterior.sources.get(name, learned[:0])[place.stop - place.start :]
            known[name] = np.concatenate([learned[place], never_seen])
        return replace(posterior, mean=posterior.mean - columns.T @ now.mean, sources={**posterior.sources, **known})

    def _at(self, t_ns: int) -> "Knowledge":
        """The knowledge at a later time: the daily part decays towards its prior."""
        place = self.slots.get(Source.DAY)
        kept = math.exp(-max(0.0, (t_ns - self.t_ns) / NS_PER_S) / DAY_MEMORY_S)
        if place is None or kept == 1.0:
            return self
        decay = np.ones(len(self.mean))
        decay[place] = kept
        covariance = decay[:, None] * self.covariance * decay
        covariance[place, place] += (1.0 - kept**2) * np.eye(place.stop - place.start)
        return replace(self, mean=decay * self.mean, covariance=covariance, t_ns=t_ns)

    def _having_seen(self, one: Observation) -> "Knowledge":
        k = len(one.truth)
        columns = self._columns(one.posterior)[:, :k]
        of_load = one.posterior.without(*_LASTING).covariance[:k, :k]
        across = self.covariance @ columns
        gain = np.linalg.solve(columns.T @ across + of_load + one.truth_covariance, across.T).T
        mean = self.mean + gain @ (one.off - columns.T @ self.mean)
        covariance = self.covariance - gain @ across.T
        return replace(self, mean=mean, covariance=0.5 * (covariance + covariance.T))

    def _columns(self, posterior: Posterior) -> F64:
        """(n, d) of all lasting sources, in the order of z."""
        columns = np.zeros((len(self.mean), posterior.size))
        for name, place in self.slots.items():
            own = posterior.sources.get(name)
            if own is not None:
                n = min(len(own), place.stop - place.start)
                columns[place.start : place.start + n] = own[:n]
        return columns


def _slots(observations: Iterable[Observation]) -> dict[Source, slice]:
    slots: dict[Source, slice] = {}
    begin = 0
    observations = list(observations)
    for name in _LASTING:
        n = max((len(one.posterior.sources[name]) for one in observations if name in one.posterior.sources), default=0)
        if n:
            slots[name] = slice(begin, begin + n)
            begin += n
    return slots
