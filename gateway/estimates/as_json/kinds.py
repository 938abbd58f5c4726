"""How fields of one kind are written in JSON and read back: numbers, weights, spectra, posteriors, ways.

Of the posterior and its budget every error is written by its source. A way has distances, standstills, door and
ignition, and positions if they are kept.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from gateway.estimates.batch_estimate import (
    NOWHERE,
    PLACES,
    UNKNOWN_INTERVAL,
    UNWATCHED,
    Lack,
    Place,
    Stop,
    Watched,
    Way,
    Weight,
    Weights,
)
from gateway.estimates.budget import BudgetLine, Remedy
from gateway.estimates.posterior import NORMAL_TAILS, Posterior, Source
from gateway.records import F64, FIRST_DATED_NS, Spectra, Why, iso_utc, ns_of


@dataclass(frozen=True, slots=True)
class FieldKind:
    """How fields of one kind are written, read back and typed. ``read`` never sees null: unknown stays unknown; it
    raises for anything of another type.

    ``cells`` makes what was written the cells of a line of CSV.
    """

    shape: Any  # for the schema
    write: Callable[[Any], Any]
    read: Callable[[Any], Any]
    cells: Callable[[Any], Sequence[Any]] = lambda shown: [shown]


def spectra_to_json(spectra: Spectra) -> dict[str, list[float | None]]:
    """The JSON object of spectra: names with units, unknown is None."""
    return {
        "freq_hz": _numbers(spectra.freq_hz, 6),
        "vertical_acceleration_mps2_rthz": _numbers(spectra.vertical_acceleration, 5),
        "pitch_rate_radps_rthz": _numbers(spectra.pitch_rate, 5),
        "coherence": _numbers(spectra.coherence, 5),
        "phase_rad": _numbers(spectra.phase_rad, 5),
    }


def spectra_from_json(told: Mapping[str, Sequence[float | None]]) -> Spectra:
    """The inverse of :func:`spectra_to_json`, within its rounding."""
    names = spectra_to_json(Spectra(*[np.empty(0)] * 5))
    return Spectra(*(np.array([math.nan if x is None else x for x in told[name]], float) for name in names))


def rounded(x: float, digits: int) -> float | None:
    """Round to so many significant digits; None if the number is not finite."""
    return float(f"{x:.{digits}g}") if math.isfinite(x) else None


def _numbers(x: F64, digits: int) -> list[float | None]:
    return [rounded(float(v), digits) for v in x]


def _interval(bounds: tuple[float, float]) -> list[float] | None:
    low, high = (rounded(b, 9) for b in bounds)
    return None if low is None or high is None else [low, high]


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


def _pair(told: Sequence[Any]) -> tuple[float, float]:
    low, high = map(float, told)
    return low, high


def weights_to_json(weights: Weights) -> dict[str, dict[str, Any]]:
    """The JSON object of weights: one for each place, unknown is None."""
    return {place: _weight(weight) for place, weight in weights.items()}


def _weight(weight: Weight) -> dict[str, Any]:
    """One place; whether it is over its limit follows from the number that is shown, which is rounded."""
    kg, limit_kg = rounded(weight.kg, 7), weight.limit_kg
    return {
        "kg": kg,
        "std_kg": rounded(weight.std_kg, 7),
        "interval95_kg": _interval(weight.interval95_kg),
        "limit_kg": limit_kg,
        "is_over_limit": kg is not None and limit_kg is not None and kg > limit_kg,
        "lacks": None if weight.lacks is None else str(weight.lacks),
        "is_unsprung_estimated": weight.is_unsprung_estimated,
    }


def _weights_of(told: Mapping[str, Mapping[str, Any]]) -> Weights:
    return Weights(**{place: _weight_of(told[place]) for place in PLACES})


def _weight_of(told: Mapping[str, Any]) -> Weight:
    kg, std_kg = (_known(told[name]) for name in ("kg", "std_kg"))
    lacks = None if told["lacks"] is None else Lack(told["lacks"])
    limit_kg = None if told["limit_kg"] is None else float(told["limit_kg"])
    interval95_kg = _pair(told["interval95_kg"] or UNKNOWN_INTERVAL)
    return Weight(kg, std_kg, limit_kg, lacks, _flag(told["is_unsprung_estimated"]), interval95_kg)


def _weight_cells(shown: Mapping[str, Mapping[str, Any]]) -> list[Any]:
    """The columns of :data:`WEIGHT_COLUMNS`; places over their limit joined by a space."""
    numbers = [shown[place][name] for place in PLACES for name in ("kg", "std_kg")]
    limits = [shown[place]["limit_kg"] for place in PLACES]
    return [*numbers, *limits, " ".join(places_over_limit(shown))]


def places_over_limit(shown: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """The places over their limit in the JSON object of weights."""
    return [place for place in PLACES if shown[place]["is_over_limit"]]


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


TEXT: Final = FieldKind(str | None, _as_is, _text)
FLAG: Final = FieldKind(bool | None, _as_is, _flag)
WHOLE: Final = FieldKind(int | None, _as_is, _whole)
COUNT: Final = FieldKind(float | None, float, int)
INSTANT: Final = FieldKind(str | None, iso_utc, ns_of)
NUMBER: Final = FieldKind(float | None, lambda x: rounded(x, 9), float)
ROUGH_NUMBER: Final = FieldKind(float | None, lambda x: rounded(x, 6), float)
INTERVAL: Final = FieldKind(list[float] | None, _interval, _pair, cells=list)
NUMBERS_BY_NAME: Final = FieldKind(
    dict[str, float | None],
    lambda numbers: {name: rounded(x, 6) for name, x in numbers.items()},
    lambda told: {name: _known(x) for name, x in told.items()},
)
REASONS: Final = FieldKind(
    list[str],
    lambda whys: [str(why) for why in whys],
    lambda told: tuple(map(Why, told)),
    lambda shown: [" ".join(shown)],
)
WEIGHTS: Final = FieldKind(dict[str, dict[str, Any]], weights_to_json, _weights_of, _weight_cells)
OVER_LIMIT: Final = "over_limit"
WEIGHT_COLUMNS: Final = (
    *(f"{place}{unit}" for place in PLACES for unit in ("_kg", "_std_kg")),
    *(f"{place}_limit_kg" for place in PLACES),
    OVER_LIMIT,
)
SPECTRA: Final = FieldKind(dict[str, list[float | None]] | None, spectra_to_json, spectra_from_json)


DIGITS: Final = 7  # chosen: significant ones, of numbers that are computed with again


def posterior_to_json(posterior: Posterior) -> dict[str, Any]:
    """The JSON object of a posterior: names as in the class, arrays as lists."""
    return {
        "mean": [rounded(x, 9) for x in posterior.mean.tolist()],
        "own": _rows(posterior.own),
        "sources": {str(name): _rows(columns) for name, columns in posterior.sources.items()},
        "tails": [rounded(x, DIGITS) for x in posterior.tails],
    }


def posterior_from_json(record: Mapping[str, Any]) -> Posterior:
    """The inverse of :func:`posterior_to_json`, within its rounding."""
    mean, own = np.array(record["mean"], float), np.array(record["own"], float)
    sources = {Source(name): np.array(rows, float) for name, rows in record["sources"].items()}
    if own.shape != mean.shape * 2 or any(rows.shape[1:] != mean.shape for rows in sources.values()):
        raise ValueError("mean, own covariance and sources are of different sizes")
    return Posterior(mean, own, sources, _pair(record.get("tails", NORMAL_TAILS)))


def _rows(matrix: F64) -> list[list[float | None]]:
    return [[rounded(x, DIGITS) for x in row] for row in matrix.tolist()]


def budget_to_json(budget: Sequence[BudgetLine]) -> list[dict[str, Any]]:
    """The JSON array of a budget: one object per source."""
    return [
        {
            "source": line.source,
            "payload_kg": rounded(line.payload_kg, 4),
            "front_share_pct": rounded(line.front_share_pct, 4),
            "cg_left_m": rounded(line.cg_left_m, 4),
            "remedy": None if line.remedy is None else str(line.remedy),
            "payload_with_remedy_kg": rounded(line.payload_with_remedy_kg, 4),
        }
        for line in budget
    ]


def budget_from_json(records: Sequence[Mapping[str, Any]]) -> tuple[BudgetLine, ...]:
    """The inverse of :func:`budget_to_json`, within its rounding."""
    numbers = ("payload_kg", "front_share_pct", "cg_left_m", "payload_with_remedy_kg")
    return tuple(
        BudgetLine(
            source=_text(record["source"]),
            remedy=None if record["remedy"] is None else Remedy(record["remedy"]),
            **{name: _known(record[name]) for name in numbers},
        )
        for record in records
    )


POSTERIOR: Final = FieldKind(
    dict[str, Any] | None, lambda one: None if one is None else posterior_to_json(one), posterior_from_json
)
BUDGET: Final = FieldKind(list[dict[str, Any]], budget_to_json, budget_from_json)


def way_to_json(way: Way) -> dict[str, Any]:
    """The JSON object of a way; unknown is None."""
    return {
        "distance_m": rounded(way.distance_m, 9),
        "known_s": way.known_s,
        "moving_s": way.moving_s,
        "odometer_start_m": rounded(way.odometer_start_m, 9),
        "odometer_end_m": rounded(way.odometer_end_m, 9),
        "start": place_to_json(way.start),
        "end": place_to_json(way.end),
        "stops": [_stop(stop) for stop in way.stops],
        "before": _watched(way.before),
        "since": None if way.since_ns is None else INSTANT.write(way.since_ns),
    }


def way_from_json(told: Mapping[str, Any]) -> Way:
    """The inverse of :func:`way_to_json`, within its rounding."""
    return Way(
        distance_m=_known(told["distance_m"]),
        known_s=float(told["known_s"]),
        moving_s=float(told["moving_s"]),
        odometer_start_m=_known(told["odometer_start_m"]),
        odometer_end_m=_known(told["odometer_end_m"]),
        start=_place_of(told["start"]),
        end=_place_of(told["end"]),
        stops=tuple(map(_stop_of, told["stops"])),
        before=_watched_of(told["before"]),
        since_ns=None if told["since"] is None else INSTANT.read(told["since"]),
    )


def place_to_json(place: Place) -> dict[str, float] | None:
    """Latitude and longitude in degrees; None if they are unknown or not kept."""
    if not place.is_known:
        return None
    return {"latitude_deg": place.latitude_deg, "longitude_deg": place.longitude_deg}


_PLACE: Final = re.compile(r'\{"latitude_deg":[^{}]*\}')


def without_places(text: str) -> str:
    """JSON of our own in which every position is null."""
    return _PLACE.sub("null", text)


def _place_of(told: Mapping[str, float] | None) -> Place:
    return NOWHERE if told is None else Place(float(told["latitude_deg"]), float(told["longitude_deg"]))


def _stop(stop: Stop) -> dict[str, Any]:
    return {
        "t_start": INSTANT.write(stop.t_start_ns),
        "t_end": INSTANT.write(stop.t_end_ns),
        **_watched(stop.watched),
        "place": place_to_json(stop.place),
    }


def _stop_of(told: Mapping[str, Any]) -> Stop:
    return Stop(INSTANT.read(told["t_start"]), INSTANT.read(told["t_end"]), _watched_of(told), _place_of(told["place"]))


def _watched(seen: Watched) -> dict[str, bool | None]:
    return {"door_opened": seen.door_opened, "ignition_off": seen.ignition_off}


def _watched_of(told: Mapping[str, Any]) -> Watched:
    opened, off = (None if told[name] is None else _flag(told[name]) for name in ("door_opened", "ignition_off"))
    seen = Watched(opened, off)
    return UNWATCHED if seen == UNWATCHED else seen


def _known(told: float | None) -> float:
    return math.nan if told is None else float(told)


WAY = FieldKind(dict[str, Any] | None, lambda way: None if way is None else way_to_json(way), way_from_json)
EXAMPLE = way_to_json(
    Way(3521.4, 299.8, 251.2, 18_204_300.0, 18_207_800.0, stops=(Stop(0, 20_000_000_000, Watched(True, False)),))
)
