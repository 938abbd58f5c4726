"""Finds the load epoch that a stated weight belongs to, from the stored estimates."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from gateway.calibration.known_weight import WeightRefusal
from gateway.errors import RefusedError, StoreError
from gateway.estimate import Estimate, Quantity
from gateway.estimate_json import read_estimate
from gateway.posterior import Posterior, fused
from gateway.records import iso_utc
from gateway.stated.facts import Drive
from gateway.store import StoreReader
from gateway.units import NS_PER_S

NEAR_NS: Final = 12 * 3600 * NS_PER_S  # chosen: a drive further away in time may have carried another load
BATCH_IDS: Final = 20  # chosen: ids kept of one load, the newest
_PAGE: Final = 500  # chosen: batches read at a time


@dataclass(frozen=True, slots=True)
class WeighedEpoch:
    """One load: the fused estimate of its counted batches as last shown, and the posterior of each batch."""

    t_start_ns: int
    t_end_ns: int
    n_batches: int
    payload: Quantity
    front_share: Quantity
    batch_ids: tuple[str, ...]
    calibration_id: str | None
    estimator: str
    known_weights_id: str | None
    measured: tuple[Posterior, ...]

    @property
    def posterior(self) -> Posterior:
        """Fused posterior of all batches by the calibration alone."""
        return fused(self.measured)

    @property
    def scale(self) -> tuple[str | None, str]:
        """The calibration and the estimator by which it was weighed."""
        return self.calibration_id, self.estimator

    def require(self, calibration_id: str | None, estimator: str) -> None:
        """Raises RefusedError if it was weighed by another calibration or estimator."""
        if self.scale != (calibration_id, estimator):
            raise RefusedError(
                WeightRefusal.OTHER_CALIBRATION,
                f"the load of {self.label()} was weighed by another calibration or estimator than the one in use: "
                "weigh it again",
            )

    def label(self) -> str:
        """Time and payload of the load, for messages."""
        return f"{iso_utc(self.t_start_ns)[:16]}Z to {iso_utc(self.t_end_ns)[:16]}Z ({self.payload.number:.0f} kg)"


def epochs_of(estimates: Iterable[Estimate]) -> list[WeighedEpoch]:
    """Estimates in order of arrival -> their load epochs, oldest first.

    The count of batches restarts with each epoch; calibration and estimator do not change within one.
    """
    epochs: list[WeighedEpoch] = []
    for estimate in estimates:
        found = _epoch_so_far(estimate)
        if found is None:
            continue
        before = epochs[-1] if epochs else None
        if before is not None and found.n_batches == before.n_batches + 1 and found.scale == before.scale:
            ids = (*before.batch_ids, *found.batch_ids)[-BATCH_IDS:]
            measured = (*before.measured, *found.measured)
            epochs[-1] = replace(found, t_start_ns=before.t_start_ns, batch_ids=ids, measured=measured)
        else:
            epochs.append(found)
    return epochs


def epoch_at(epochs: Sequence[WeighedEpoch], at_ns: int, drive: Drive | None) -> WeighedEpoch:
    """The epoch whose load was weighed at this time. Raises RefusedError if there is none, or if there are two.

    Within a drive the epoch is unambiguous. Between two drives it may be the earlier or the later one.
    """
    near = [epoch for epoch in epochs if epoch.t_start_ns - NEAR_NS <= at_ns <= epoch.t_end_ns + NEAR_NS]
    during = [epoch for epoch in near if epoch.t_start_ns <= at_ns <= epoch.t_end_ns]
    if during:
        return during[-1]
    before = [epoch for epoch in near if epoch.t_end_ns < at_ns][-1:]
    after = [epoch for epoch in near if epoch.t_start_ns > at_ns][:1]
    candidates = {Drive.BEFORE: before, Drive.AFTER: after, None: before + after}[drive]
    if not candidates:
        raise RefusedError(
            WeightRefusal.NO_EPOCH,
            f"no load was weighed {'around' if drive is None else drive} {iso_utc(at_ns)[:16]}Z (12 hours at most): "
            "drive with it until a batch has counted, and state it then with the time at which it was known",
        )
    if len(candidates) > 1:
        raise RefusedError(
            WeightRefusal.AMBIGUOUS_EPOCH,
            f"{iso_utc(at_ns)[:16]}Z lies between two loads, {before[0].label()} and {after[0].label()}: state whether "
            f"it belongs to the drive before or after",
        )
    return candidates[0]


def epochs_around(reader: StoreReader, at_ns: int) -> list[WeighedEpoch]:
    """The stored epochs around a time. Raises RefusedError if the store cannot be read."""
    try:
        return epochs_of(_estimates(reader, at_ns - NEAR_NS, at_ns + NEAR_NS))
    except (StoreError, TimeoutError) as fault:
        raise RefusedError(WeightRefusal.NOT_STORED, f"the store cannot be read now: {fault}") from None


def _estimates(reader: StoreReader, since_ns: int, until_ns: int) -> Iterator[Estimate]:
    cursor: str | None = None
    while True:
        page = reader.estimates(since_ns=since_ns, until_ns=until_ns, limit=_PAGE, cursor=cursor, with_spectra=False)
        yield from reader.understood(page.items, read_estimate)
        if page.next_cursor is None:
            return
        cursor = page.next_cursor


def _epoch_so_far(found: Estimate) -> WeighedEpoch | None:
    """The load epoch with a counted batch as its newest; None for a rejected batch."""
    measured = found.as_measured
    if not found.counted or found.epoch is None or measured is None:
        return None
    return WeighedEpoch(
        t_start_ns=found.t_start_ns,
        t_end_ns=found.t_end_ns,
        n_batches=found.epoch.n_batches,
        payload=found.epoch.payload,
        front_share=found.epoch.front_share,
        batch_ids=(found.id,),
        calibration_id=found.calibration_id,
        estimator=found.estimator,
        known_weights_id=found.known_weights_id,
        measured=(measured,),
    )
