"""How fields of one kind are written in JSON and read back: numbers, weights, spectra, posteriors, ways.

Of the posterior and its budget every error is written by its source. A way has distances, standstills, door and
ignition, and positions if they are kept.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final

import numpy as np

from gateway.estimates.batch_estimate import (
    NOWHERE,
    PLACES,
    UNKNOWN_INTERVAL,
    Lack,
    Place,
    Stop,
    Watched,
    Way,
    Weight,
    Weights,
)
from gateway.estimates.budget import BudgetLine, Remedy
from gateway.estimates.posterior import Posterior, Source
from gateway.records import F64, FIRST_DATED_NS, Spectra, Why, iso_utc, ns_of


@dataclass(frozen=True, slots=True)
class FieldKind:
    """How fields of one kind are written, read back and typed. ``read`` never sees null, which means ``unknown``; it
    raises for anything of another type.

    ``cells`` makes what was written the cells of a line of CSV.
    """

    shape: Any  # for the schema
    write: Callable[[Any], Any]
    read: Callable[[Any], Any]
    cells: Callable[[Any], Sequence[Any]] = lambda shown: [shown]
    unknown: Any = None


def rounded(x: float, digits: int) -> float | None:
    """Round to so many significant digits; None if the number is not finite."""
    return float(f"{x:.{digits}g}") if math.isfinite(x) else None


def _number(digits: int) -> FieldKind:
    return FieldKind(float | None, lambda x: rounded(x, digits), float, unknown=math.nan)


def _numbers(digits: int) -> FieldKind:
    """Arrays (n,) as lists."""
    return FieldKind(
        list[float | None],
        lambda x: [rounded(one, digits) for one in x.tolist()],
        lambda told: np.array([math.nan if one is None else one for one in told], float),
    )


def _one_of(names: type[StrEnum]) -> FieldKind:
    return FieldKind(str | None, str, names)


def _many(kind: FieldKind) -> FieldKind:
    return FieldKind(
        list[kind.shape],  # type: ignore[name-defined] # a type at run time, for the schema
        lambda records: [kind.write(one) for one in records],
        lambda told: tuple(kind.read(one) for one in told),
    )


def _record(made: Callable[..., Any], kinds: Mapping[str, FieldKind], **attributes: str) -> FieldKind:
    """Records as objects: a field of each name and kind, from the attribute of that name or the one that
    ``attributes`` gives for it.
    """
    rows = [(name, attributes.get(name, name), kind) for name, kind in kinds.items()]

    def write(record: Any) -> dict[str, Any] | None:
        if record is None:
            return None
        known = ((name, getattr(record, attribute), kind) for name, attribute, kind in rows)
        return {name: None if one is None else kind.write(one) for name, one, kind in known}

    def read(told: Mapping[str, Any]) -> Any:
        shown = ((attribute, told[name], kind) for name, attribute, kind in rows)
        return made(**{name: kind.unknown if one is None else kind.read(one) for name, one, kind in shown})

    return FieldKind(dict[str, Any] | None, write, read)


def _as_is(x: Any) -> Any:
    return x


def _text(x: object) -> str:
    if not isinstance(x, str):
        raise TypeError(f"{x!r:.40} is no text")
    return x


def _flag(x: object) -> bool:
    if not isinstance(x, bool):
        raise TypeError(f"{x!r:.40} is neither true nor false")
    return x


def _whole(x: object) -> int:
    if not isinstance(x, int) or isinstance(x, bool) or not -(2**63) <= x < 2**63:
        raise TypeError(f"{x!r:.40} is no integer of 64 bits")
    return x


def _interval(bounds: tuple[float, float]) -> list[float] | None:
    low, high = (rounded(b, 9) for b in bounds)
    return None if low is None or high is None else [low, high]


def _pair(told: Sequence[Any]) -> tuple[float, float]:
    low, high = map(float, told)
    return low, high


TEXT: Final = FieldKind(str | None, _as_is, _text)
FLAG: Final = FieldKind(bool | None, _as_is, _flag)
WHOLE: Final = FieldKind(int | None, _as_is, _whole)
COUNT: Final = FieldKind(float | None, float, int)
INSTANT: Final = FieldKind(str | None, iso_utc, ns_of)
NUMBER: Final = _number(9)
ROUGH_NUMBER: Final = _number(6)
_PLAIN_NUMBER: Final = FieldKind(float | None, _as_is, float)
INTERVAL: Final = FieldKind(list[float] | None, _interval, _pair, cells=list, unknown=UNKNOWN_INTERVAL)
NUMBERS_BY_NAME: Final = FieldKind(
    dict[str, float | None],
    lambda numbers: {name: ROUGH_NUMBER.write(x) for name, x in numbers.items()},
    lambda told: {name: math.nan if x is None else float(x) for name, x in told.items()},
)
REASONS: Final = replace(_many(_one_of(Why)), shape=list[str], cells=lambda shown: [" ".join(shown)])
SPECTRA: Final = _record(
    Spectra,
    {
        "freq_hz": _numbers(6),
        "vertical_acceleration_mps2_rthz": _numbers(5),
        "pitch_rate_radps_rthz": _numbers(5),
        "coherence": _numbers(5),
        "phase_rad": _numbers(5),
    },
    vertical_acceleration_mps2_rthz="vertical_acceleration",
    pitch_rate_radps_rthz="pitch_rate",
)
BUDGET: Final = _many(
    _record(
        BudgetLine,
        {
            "source": TEXT,
            "payload_kg": _number(4),
            "front_share_pct": _number(4),
            "cg_left_m": _number(4),
            "remedy": _one_of(Remedy),
            "payload_with_remedy_kg": _number(4),
        },
    )
)


_WEIGHT: Final = _record(
    Weight,
    {
        "kg": _number(7),
        "std_kg": _number(7),
        "interval95_kg": INTERVAL,
        "limit_kg": _PLAIN_NUMBER,
        "lacks": _one_of(Lack),
        "is_unsprung_estimated": FLAG,
    },
)


def _write_weight(weight: Weight) -> dict[str, Any]:
    """One place; whether it is over its limit follows from the number that is shown, which is rounded."""
    told = _WEIGHT.write(weight)
    kg, limit_kg = told["kg"], told["limit_kg"]
    return {**told, "is_over_limit": kg is not None and limit_kg is not None and kg > limit_kg}


def places_over_limit(shown: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """The places over their limit in the JSON object of weights."""
    return [place for place in PLACES if shown[place]["is_over_limit"]]


def _weight_cells(shown: Mapping[str, Mapping[str, Any]]) -> list[Any]:
    """The columns of :data:`WEIGHT_COLUMNS`; places over their limit joined by a space."""
    numbers = [shown[place][name] for place in PLACES for name in ("kg", "std_kg")]
    limits = [shown[place]["limit_kg"] for place in PLACES]
    return [*numbers, *limits, " ".join(places_over_limit(shown))]


OVER_LIMIT: Final = "over_limit"
WEIGHT_COLUMNS: Final = (
    *(f"{place}{unit}" for place in PLACES for unit in ("_kg", "_std_kg")),
    *(f"{place}_limit_kg" for place in PLACES),
    OVER_LIMIT,
)
WEIGHTS: Final = replace(
    _record(Weights, dict.fromkeys(PLACES, replace(_WEIGHT, write=_write_weight))),
    shape=dict[str, dict[str, Any]],
    cells=_weight_cells,
)


DIGITS: Final = 7  # chosen: significant ones, of numbers that are computed with again


def _write_posterior(posterior: Posterior | None) -> dict[str, Any] | None:
    if posterior is None:
        return None
    return {
        "mean": [rounded(x, 9) for x in posterior.mean.tolist()],
        "own": _rows(posterior.own),
        "sources": {str(name): _rows(columns) for name, columns in posterior.sources.items()},
        "tails": [rounded(x, DIGITS) for x in posterior.tails],
        "leans": [rounded(x, DIGITS) for x in posterior.leans],
    }


def _read_posterior(record: Mapping[str, Any]) -> Posterior:
    mean, own = np.array(record["mean"], float), np.array(record["own"], float)
    sources = {Source(name): np.array(rows, float) for name, rows in record["sources"].items()}
    if own.shape != mean.shape * 2 or any(rows.shape[1:] != mean.shape for rows in sources.values()):
        raise ValueError("mean, own covariance and sources are of different sizes")
    return Posterior(mean, own, sources, _pair(record["tails"]), _pair(record["leans"]))


def _rows(matrix: F64) -> list[list[float | None]]:
    return [[rounded(x, DIGITS) for x in row] for row in matrix.tolist()]


POSTERIOR: Final = FieldKind(dict[str, Any] | None, _write_posterior, _read_posterior)


_POSITION: Final = _record(Place, {"latitude_deg": _PLAIN_NUMBER, "longitude_deg": _PLAIN_NUMBER})
PLACE: Final = replace(
    _POSITION, write=lambda place: _POSITION.write(place) if place.is_known else None, unknown=NOWHERE
)
"""Latitude and longitude in degrees; null if they are unknown or not kept."""

_WATCHED: Final = _record(Watched, {"door_opened": FLAG, "ignition_off": FLAG})
_STANDSTILL: Final = _record(
    Stop, {"t_start": INSTANT, "t_end": INSTANT, "place": PLACE}, t_start="t_start_ns", t_end="t_end_ns"
)
_STOP: Final = FieldKind(
    dict[str, Any],
    lambda stop: _STANDSTILL.write(stop) | _WATCHED.write(stop.watched),
    lambda told: replace(_STANDSTILL.read(told), watched=_WATCHED.read(told)),
)
WAY: Final = _record(
    Way,
    {
        "distance_m": NUMBER,
        "known_s": _PLAIN_NUMBER,
        "moving_s": _PLAIN_NUMBER,
        "odometer_start_m": NUMBER,
        "odometer_end_m": NUMBER,
        "start": PLACE,
        "end": PLACE,
        "stops": _many(_STOP),
        "before": _WATCHED,
        "since": INSTANT,
    },
    since="since_ns",
)
EXAMPLE: Final = WAY.write(
    Way(3521.4, 299.8, 251.2, 18_204_300.0, 18_207_800.0, stops=(Stop(0, 20_000_000_000, Watched(True, False)),))
)

_PLACE_TEXT: Final = re.compile(r'\{"latitude_deg":[^{}]*\}')


def without_places(text: str) -> str:
    """JSON of our own in which every position is null."""
    return _PLACE_TEXT.sub("null", text)


_INSTANTS: Final = ("t_start", "t_end", "since")


def without_dates(told: Any) -> Any:
    """JSON of our own with null for instants before 1986, of a log without a date.

    Beside each stands the time from the zero of the log's stamps: ``t_start_ns``, ``t_end_ns``, ``since_ns``.
    """
    if isinstance(told, Sequence) and not isinstance(told, str):
        return [without_dates(one) for one in told]
    if not isinstance(told, Mapping):
        return told
    undated = [name for name in _INSTANTS if told.get(name) and ns_of(told[name]) < FIRST_DATED_NS]
    times = {f"{name}_ns": ns_of(told[name]) for name in undated}
    return times | {name: None if name in undated else without_dates(one) for name, one in told.items()}
