"""The posterior of a load with its error by source: own covariance of a batch, and columns shared by batches.

The quantities are, in this order, the payload (kg), the front share of the sprung mass (%) and, where a roll rate was
read, the lateral place of the centre of gravity (m left of the centre line). A source is a cause that several batches
share; its columns say by how much one standard deviation of that cause moves each quantity at this load. What no other
batch shares is ``own``. With independent standard normal z the error is

    own error + sum over sources of z_k column_k,    covariance = own + sum of column_k column_k'

so that a common cause cancels in a difference, and whatever is learned of z narrows every estimate that depends on it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import Final

import numpy as np

from gateway.estimates.quantity import UNKNOWN, Z95, Quantity
from gateway.records import F64

PAYLOAD, FRONT_SHARE, CG_LEFT = range(3)  # the order of the quantities


class Source(StrEnum):
    """Sources of error that batches share; the lifetime of each decides which errors cancel in a difference."""

    CALIBRATION = "calibration"  # what known loads left open of the vehicle; for ever
    GOODS = "goods"  # how long and high the loads of this vehicle usually are; for ever
    LOAD_LENGTH = "load_length"  # this load's deviation from that, and how it stands; one load
    DAY = "day"  # springs, tyres, dampers: temperature and wear; days
    SENSOR = "sensor"  # gain; until the sensor is changed
    SIDEWAYS = "sideways"  # where the load lies across, if no roll rate tells; one load
    EMPTY_SHARE = "empty_share"  # the front share of the empty vehicle, as stated; for ever
    MODEL = "model"  # what runs left out of the calibration showed beyond all that; one load


SHAPE: Final = (Source.GOODS, Source.LOAD_LENGTH)
ONE_LOAD: Final = frozenset({Source.LOAD_LENGTH, Source.SIDEWAYS, Source.MODEL})
NORMAL_TAILS: Final = (Z95, Z95)
UPRIGHT: Final = (1.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Posterior:
    """Mean (d,), own covariance (d, d) and columns (k, d) by source, d being 2, 3 with a lateral place, or 1 for a
    payload alone.

    ``tails`` are the distances of the 2.5 and the 97.5 % point of the error from the load's shape, in its standard
    deviations: a load can be much longer than it is thought to be, but hardly shorter. ``leans`` say how many times
    farther than that of a normal error the payload's interval reaches towards lighter and towards heavier loads.
    """

    mean: F64
    own: F64
    sources: Mapping[Source, F64] = field(default_factory=dict)
    tails: tuple[float, float] = NORMAL_TAILS
    leans: tuple[float, float] = UPRIGHT

    def __eq__(self, other: object) -> bool:
        """Whether all numbers are bit-identical."""
        if not isinstance(other, Posterior) or self.sources.keys() != other.sources.keys():
            return False
        return (
            self.tails == other.tails
            and self.leans == other.leans
            and np.array_equal(self.mean, other.mean)
            and np.array_equal(self.own, other.own)
            and all(np.array_equal(columns, other.sources[name]) for name, columns in self.sources.items())
        )

    def __hash__(self) -> int:
        return hash((self.mean.tobytes(), self.own.tobytes(), self.tails, self.leans))

    @property
    def size(self) -> int:
        """Number of known quantities."""
        return len(self.mean)

    @property
    def covariance(self) -> F64:
        """Covariance (d, d) of all errors together."""
        return self.own + self.shared

    @property
    def shared(self) -> F64:
        """Covariance (d, d) of the errors shared with other batches."""
        return sum((columns.T @ columns for columns in self.sources.values()), np.zeros((self.size, self.size)))

    def std(self, quantity: int) -> float:
        """Standard deviation of one quantity; NaN if it is unknown."""
        return math.sqrt(float(self.covariance[quantity, quantity])) if quantity < self.size else math.nan

    def correlation(self, one: int, other: int) -> float:
        """Correlation of two errors, -1 to 1; NaN if either is unknown or zero."""
        if max(one, other) >= self.size or not (scale := self.std(one) * self.std(other)):
            return math.nan
        return float(self.covariance[one, other]) / scale

    def quantity(self, quantity: int) -> Quantity:
        """One quantity with its 95 % interval; UNKNOWN if it is not known."""
        if quantity >= self.size:
            return UNKNOWN
        slopes = np.zeros(self.size)
        slopes[quantity] = 1.0
        return self.linear(float(self.mean[quantity]), slopes)

    def linear(self, number: float, slopes: Sequence[float] | F64, independent_std: float = 0.0) -> Quantity:
        """A function of the quantities that has this value and these slopes (up to d) at the mean, to first order.

        ``independent_std`` is an error of its own. Slopes by an unknown lateral place make it unknown.
        """
        slopes = np.asarray(slopes, float)
        if np.any(slopes[self.size :]):
            return Quantity(number)
        whole = np.zeros(self.size)
        whole[: len(slopes[: self.size])] = slopes[: self.size]
        by_shape = sum(float(np.sum((self.sources[name] @ whole) ** 2)) for name in SHAPE if name in self.sources)
        variance = float(whole @ self.covariance @ whole) + independent_std**2
        rest = Z95**2 * max(variance - by_shape, 0.0)
        low, high = (
            lean * math.sqrt(rest + tail**2 * by_shape)
            for tail, lean in zip(self._tails_along(whole), self._leans_along(whole, variance), strict=True)
        )
        return Quantity(number, math.sqrt(max(variance, 0.0)), (number - low, number + high))

    def _tails_along(self, slopes: F64) -> tuple[float, float]:
        """Skewed interval; the tails are swapped for a quantity that falls as the payload rises."""
        rises = sum(
            float((self.sources[name] @ slopes) @ self.sources[name][:, PAYLOAD])
            for name in SHAPE
            if name in self.sources
        )
        return self.tails if rises >= 0.0 else (self.tails[1], self.tails[0])

    def _leans_along(self, slopes: F64, variance: float) -> tuple[float, float]:
        """The leans of a quantity, by the part of its variance that follows the payload; swapped where it falls as the
        payload rises.
        """
        of_payload = self.covariance[PAYLOAD]
        follows = float(of_payload @ slopes)
        part = follows**2 / max(float(of_payload[PAYLOAD]) * variance, 1e-300)
        low, high = (1.0 + part * (lean - 1.0) for lean in self.leans)
        return (low, high) if follows >= 0.0 else (high, low)

    def covariance_of(self, slopes: Sequence[float] | F64, other_slopes: Sequence[float] | F64) -> float:
        """Covariance of two linear functions of the quantities."""
        one, other = np.zeros(self.size), np.zeros(self.size)
        one[: len(slopes)], other[: len(other_slopes)] = slopes[: self.size], other_slopes[: self.size]
        return float(one @ self.covariance @ other)

    def with_source(self, name: Source, columns: F64) -> "Posterior":
        """The posterior with more columns (k, d) of one source."""
        before = self.sources.get(name)
        together = columns if before is None else np.concatenate([before, columns])
        return replace(self, sources={**self.sources, name: together})

    def without(self, *names: Source) -> "Posterior":
        """The posterior without the errors of these sources."""
        return replace(self, sources={name: one for name, one in self.sources.items() if name not in names})

    def first(self, n: int) -> "Posterior":
        """The posterior of the first ``n`` quantities only."""
        if n >= self.size:
            return self
        sources = {name: columns[:, :n] for name, columns in self.sources.items()}
        return replace(self, mean=self.mean[:n], own=self.own[:n, :n], sources=sources)

    def share_of(self, name: Source) -> F64:
        """(d,) standard deviations that one source contributes."""
        columns = self.sources.get(name)
        return np.zeros(self.size) if columns is None else np.sqrt(np.sum(columns**2, axis=0))


def exactly(*numbers: float) -> Posterior:
    """The posterior of a load known without error: payload (kg), front share (%) and lateral position (m)."""
    return Posterior(np.array(numbers, float), np.zeros((len(numbers), len(numbers))))


def fused(parts: Sequence[Posterior]) -> Posterior:
    """Fuse several batches of one load (see Fusible). Raises ValueError without parts."""
    return Fusible(parts).fused(0, len(parts))


class Fusible:
    """Batches in order, of which any consecutive ones can be fused. A single batch stays unchanged."""

    def __init__(self, parts: Sequence[Posterior]) -> None:
        self._parts = parts

    def fused(self, first: int, stop: int) -> Posterior:
        """Fuse the parts ``first`` to ``stop`` (exclusive). Raises ValueError if there is none."""
        if stop <= first:
            raise ValueError("there is no batch to fuse")
        return self._parts[first] if stop - first == 1 else self._sums.fused(first, stop)

    @cached_property
    def _sums(self) -> "_Sums":
        return _Sums(self._parts)


class _Sums:
    """The sums of a fusion: own errors average out by their precision, shared ones stay.

    The weights are W_i = (sum P)^-1 P_i with P_i the inverse of own covariance i; a batch that does not know the
    lateral place has no precision there. Columns of one source stand for the same causes in every part and average
    with the same weights.
    """

    def __init__(self, parts: Sequence[Posterior]) -> None:
        self._sizes = np.array([part.size for part in parts], int)
        size = int(self._sizes.max())
        self._precisions = np.zeros((len(parts), size, size))
        for known in set(self._sizes.tolist()):
            alike = np.flatnonzero(self._sizes == known).tolist()
            self._precisions[alike, :known, :known] = np.linalg.inv(np.array([parts[i].own for i in alike]))
        self._about = np.zeros(size)  # what is equal everywhere stays so to the last bit
        self._about[: parts[0].size] = parts[0].mean
        self._means = self._weighted([(part.mean - self._about[: part.size])[None] for part in parts])[:, 0]
        self._columns = {
            name: self._weighted([part.sources.get(name, np.zeros((0, size))) for part in parts])
            for name in Source
            if any(name in part.sources for part in parts)
        }
        self._n_columns = {
            name: np.array([len(part.sources[name]) if name in part.sources else -1 for part in parts])
            for name in self._columns
        }
        self._skews = np.array([(*part.tails, *part.leans) for part in parts])

    def _weighted(self, rows: Sequence[F64]) -> F64:
        """(n, c, size) rows (c, d) of each part times its precision; 0 if a part has fewer."""
        size = self._precisions.shape[-1]
        whole = np.zeros((len(rows), max(len(each) for each in rows), size))
        for i, each in enumerate(rows):
            whole[i, : len(each), : each.shape[1]] = each
        weighted: F64 = whole @ self._precisions
        return weighted

    def fused(self, first: int, stop: int) -> Posterior:
        """Fuse the parts ``first`` to ``stop`` (exclusive)."""
        some = slice(first, stop)
        size = int(self._sizes[some].max())
        precisions = self._precisions[some, :size, :size]
        own = np.linalg.inv(precisions.sum(axis=0))
        sources = {}
        for name, columns in self._columns.items():
            n_columns = int(self._n_columns[name][some].max())
            if n_columns >= 0:
                sources[name] = columns[some, :n_columns, :size].sum(axis=0) @ own
        weights = np.abs(precisions[:, :, PAYLOAD] @ own[PAYLOAD])
        low, high, lighter, heavier = (weights @ self._skews[some] / weights.sum()).tolist()
        mean = self._about[:size] + own @ self._means[some, :size].sum(axis=0)
        return Posterior(mean, 0.5 * (own + own.T), sources, (low, high), (lighter, heavier))


def difference(before: Posterior, after: Posterior, *, is_one_load: bool) -> tuple[F64, F64]:
    """``after`` less ``before``: mean (d,) and covariance (d, d), over the quantities that both know.

    Columns subtract before they are squared, so that a common cause cancels. Sources that last for one load cancel
    likewise if it is one load; of two loads they are as common as the smaller is a part of the larger.
    """
    size = min(before.size, after.size)
    before, after = before.first(size), after.first(size)
    mean = after.mean - before.mean
    covariance = before.own + after.own
    larger = max(abs(float(before.mean[PAYLOAD])), abs(float(after.mean[PAYLOAD])), 1e-9)
    common = 1.0 if is_one_load else max(0.0, 1.0 - abs(float(mean[PAYLOAD])) / larger)
    for name in {**before.sources, **after.sources}:
        one, other = _paired(before.sources.get(name), after.sources.get(name), size)
        rho = common if name in ONE_LOAD else 1.0
        crossed = one.T @ other
        covariance = covariance + one.T @ one + other.T @ other - rho * (crossed + crossed.T)
    return mean, covariance


def _paired(one: F64 | None, other: F64 | None, size: int) -> tuple[F64, F64]:
    """Pad the columns of both with zeros to the same number."""
    if one is not None and other is not None and len(one) == len(other):
        return one, other
    n = max(0 if each is None else len(each) for each in (one, other))
    both = np.zeros((2, n, size))
    for i, each in enumerate((one, other)):
        if each is not None:
            both[i, : len(each)] = each
    return both[0], both[1]
