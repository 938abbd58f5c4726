"""Log lines for changes: one when the batches or the service change state, none while they stay the same."""

import logging
import math
from collections.abc import Callable

from gateway.estimate import PLACES, Estimate
from gateway.log import Event, log_event
from gateway.records import Why
from gateway.status import State, Status
from gateway.web.live.board import Board
from gateway.web.routes.weights import LatestWeights


class BatchLog:
    """Called by the pipeline with every batch. ``weigh`` returns the weights shown by the web, with warnings."""

    def __init__(self, weigh: Callable[[], LatestWeights]) -> None:
        self._weigh = weigh
        self._rejected: frozenset[Why] = frozenset()  # of the last full batch; before the first, as if it had counted
        self._overloaded = self._now_overloaded()

    def __call__(self, found: Estimate) -> None:
        """Log a new estimate at level info; rejected and provisional ones at level debug."""
        if found.is_remainder:
            return
        is_answer = found.counted and not found.is_provisional
        event = Event.PROVISIONAL if found.is_provisional else Event.ESTIMATE if found.counted else Event.REJECTED
        log_event(
            event,
            level=logging.INFO if is_answer else logging.DEBUG,
            batch=found.id,
            payload_kg=_or_none(found.payload.number),
            payload_std_kg=_or_none(found.payload.std),
            front_share_pct=_or_none(found.front_share.number),
            rejected=found.rejected,
        )
        if not found.is_provisional:
            self._tell_reasons(found.rejected)
            self._tell_overload()

    def _tell_reasons(self, rejected: tuple[Why, ...]) -> None:
        """Log the reasons of rejection if they differ from those of the batch before."""
        before, self._rejected = self._rejected, frozenset(rejected)
        if self._rejected != before:
            log_event(Event.REASONS_CHANGED, rejected=rejected, before=sorted(before))

    def _tell_overload(self) -> None:
        before, self._overloaded = self._overloaded, self._now_overloaded()
        if before == self._overloaded:
            return
        weights = self._weigh()
        for where in PLACES:
            if (where in before) is not (where in self._overloaded):
                figure = getattr(weights, where)
                is_over = where in self._overloaded
                log_event(
                    Event.OVERLOAD_BEGINS if is_over else Event.OVERLOAD_ENDS,
                    level=logging.WARNING if is_over else logging.INFO,
                    where=where,
                    kg=figure.kg,
                    limit_kg=figure.limit_kg,
                )

    def _now_overloaded(self) -> frozenset[str]:
        weights = self._weigh()
        return frozenset(where for where in PLACES if getattr(weights, where).is_over_limit)


def call_each(*hearers: Callable[[Estimate], None]) -> Callable[[Estimate], None]:
    """A callback that passes each batch to several listeners."""

    def tell(found: Estimate) -> None:
        for hear in hearers:
            hear(found)

    return tell


class StateLog:
    """Called often with the service's state; writes a line if it differs from the last one."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._state: State | None = None
        self._is_stale = board.is_stale()

    def __call__(self, now: Status) -> None:
        """Log a change of the state, and of whether the shown estimate is stale."""
        if now.state is not self._state:
            log_event(Event.STATE, state=now.state, before=self._state, sentence=now.sentence())
            self._state = now.state
        if (is_stale := self._board.is_stale()) is not self._is_stale:
            log_event(Event.STALE if is_stale else Event.FRESH, age_s=round(self._board.age_s() or 0.0, 1))
            self._is_stale = is_stale


def _or_none(x: float) -> float | None:
    return round(x, 3) if math.isfinite(x) else None
