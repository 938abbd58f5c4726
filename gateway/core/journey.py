"""The way of a batch from the rows of its window, and the door and ignition state between drives."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Final

import numpy as np

from gateway.core.batch_settings import BatchSettings
from gateway.core.spectrum import runs_of
from gateway.core.timeline import sort_by_time
from gateway.estimates.batch_estimate import NOWHERE, UNWATCHED, Place, Stop, Watched, Way
from gateway.records import F64, I64, JOURNEY, Batch, Bool, Motion, SensorTraits, Signal
from gateway.units import NS_PER_S

LEAST_STOP_S: Final = 10.0  # chosen: a shorter stop is traffic
MOST_STOPS: Final = 30  # chosen: limit per batch, so that jumping time stamps cannot fill a record
COARSEST_ODOMETER_M: Final = 100.0  # chosen: an odometer in whole kilometres is less precise than the integrated speed
_FIRST_NS, _LAST_NS = int(np.iinfo(np.int64).min), int(np.iinfo(np.int64).max)
PLACE_WITHIN_S: Final = 10.0  # chosen: oldest position that still counts for a moment


def way_of(
    rows: Motion, batch: Batch, settings: BatchSettings, traits: Mapping[Signal, SensorTraits], before: Watched
) -> Way:
    """The way of a batch, from the rows of its window (more rows do no harm) and its speed on the grid."""
    rows = rows.rows((rows.t_ns >= batch.t_start_ns) & (rows.t_ns < batch.t_end_ns)) if _has_journey(rows) else rows
    speed_mps, rate_hz = batch.speed_mps, batch.rate_hz
    known = np.isfinite(speed_mps)
    moving = known & (speed_mps >= settings.standstill_speed_mps)
    places = _Places(rows, settings.position_decimals)
    stops = tuple(
        Stop(begin_ns, end_ns, watched(rows, begin_ns, end_ns), places.at(begin_ns))
        for begin_ns, end_ns in _stands(known & ~moving, rate_hz, batch.t_start_ns)[:MOST_STOPS]
    )
    odometer = _odometer(rows, traits)
    return Way(
        distance_m=float(np.sum(speed_mps[moving])) / rate_hz if known.any() else math.nan,
        known_s=float(np.count_nonzero(known)) / rate_hz,
        moving_s=float(np.count_nonzero(moving)) / rate_hz,
        odometer_start_m=odometer[0],
        odometer_end_m=odometer[1],
        start=places.at(batch.t_start_ns),
        end=places.at(batch.t_end_ns),
        stops=stops,
        before=before,
    )


def _has_journey(rows: Motion) -> bool:
    return not JOURNEY.isdisjoint(rows.signals)


def watched(rows: Motion, begin_ns: int, end_ns: int) -> Watched:
    """Whether the door opened and the ignition went off from begin to end, both inclusive."""
    return Watched(
        _happened(rows, Signal.DOOR, begin_ns, end_ns, lambda x: x > 0.0),
        _happened(rows, Signal.IGNITION, begin_ns, end_ns, lambda x: x == 0.0),
    )


def watched_all(parts: Iterable[Motion]) -> Watched:
    """Watches all rows, whatever their time stamps."""
    seen = UNWATCHED
    for rows in parts:
        if _has_journey(rows):
            seen = seen.joined(watched(rows, _FIRST_NS, _LAST_NS))
    return seen


def _happened(rows: Motion, signal: Signal, begin_ns: int, end_ns: int, is_so: Callable[[F64], Bool]) -> bool | None:
    t_ns, x = rows.of(signal)
    x = x[(t_ns >= begin_ns) & (t_ns <= end_ns)]
    return bool(np.any(is_so(x))) if x.size else None


def _stands(still: Bool, rate_hz: float, start_ns: int) -> list[tuple[int, int]]:
    """Begin and end (ns) of every standstill that is long enough or touches an end of the batch."""
    return [
        (start_ns + round(begin / rate_hz * NS_PER_S), start_ns + round(end / rate_hz * NS_PER_S))
        for begin, end in runs_of(still).tolist()
        if end - begin >= LEAST_STOP_S * rate_hz or begin == 0 or end == len(still)
    ]


def _odometer(rows: Motion, traits: Mapping[Signal, SensorTraits]) -> tuple[float, float]:
    """First and last reading (m); NaN if the odometer's resolution is too coarse."""
    _, x = sort_by_time(*rows.of(Signal.ODOMETER))
    trait = traits.get(Signal.ODOMETER, SensorTraits())
    if not x.size or trait.resolution > COARSEST_ODOMETER_M:
        return math.nan, math.nan
    return float(x[0]), float(x[-1])


class _Places:
    """Positions of a window by time; none if the settings forbid to keep them."""

    def __init__(self, rows: Motion, decimals: int | None) -> None:
        self._decimals = decimals
        empty: tuple[I64, F64] = (np.empty(0, np.int64), np.empty(0))
        self._latitude = empty if decimals is None else sort_by_time(*rows.of(Signal.LATITUDE))
        self._longitude = empty if decimals is None else sort_by_time(*rows.of(Signal.LONGITUDE))

    def at(self, t_ns: int) -> Place:
        """The position nearest in time, rounded."""
        latitude, longitude = self._nearest(self._latitude, t_ns), self._nearest(self._longitude, t_ns)
        return NOWHERE if latitude is None or longitude is None else Place(latitude, longitude)

    def _nearest(self, track: tuple[I64, F64], t_ns: int) -> float | None:
        stamps_ns, x = track
        if not x.size or self._decimals is None:
            return None
        right = int(np.searchsorted(stamps_ns, t_ns))
        near = min((i for i in (right - 1, right) if 0 <= i < len(x)), key=lambda i: abs(int(stamps_ns[i]) - t_ns))
        is_near = abs(int(stamps_ns[near]) - t_ns) <= PLACE_WITHIN_S * NS_PER_S
        return round(float(x[near]), self._decimals) if is_near else None
