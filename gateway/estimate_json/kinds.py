"""How fields of one kind are written in JSON and read back: numbers, intervals, instants, reasons, weights, spectra."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from gateway.estimate import PLACES, UNKNOWN_INTERVAL, Lack, Weight, Weights
from gateway.records import F64, Spectra, Why, iso_utc, ns_of


@dataclass(frozen=True, slots=True)
class FieldKind:
    """How fields of one kind are written, read back and typed. ``read`` never sees null: unknown stays unknown.

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
    return Spectra(*(np.array([math.nan if x is None else x for x in told[name]]) for name in names))


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


def weights_to_json(weights: Weights) -> dict[str, dict[str, Any]]:
    """The JSON object of weights: one for each place, unknown is None."""
    return {place: _weight(weight) for place, weight in weights.items()}


def _weight(weight: Weight) -> dict[str, Any]:
    return {
        "kg": rounded(weight.kg, 7),
        "std_kg": rounded(weight.std_kg, 7),
        "interval95_kg": _interval(weight.interval95_kg),
        "limit_kg": weight.limit_kg,
        "is_over_limit": weight.is_over_limit,
        "lacks": None if weight.lacks is None else str(weight.lacks),
        "is_unsprung_estimated": weight.is_unsprung_estimated,
    }


def _weights_of(told: Mapping[str, Mapping[str, Any]]) -> Weights:
    return Weights(**{place: _weight_of(told[place]) for place in PLACES})


def _weight_of(told: Mapping[str, Any]) -> Weight:
    kg, std_kg = (math.nan if told[name] is None else told[name] for name in ("kg", "std_kg"))
    lacks = None if told["lacks"] is None else Lack(told["lacks"])
    low_kg, high_kg = told["interval95_kg"] or UNKNOWN_INTERVAL
    return Weight(kg, std_kg, told["limit_kg"], lacks, told["is_unsprung_estimated"], (low_kg, high_kg))


def _weight_cells(shown: Mapping[str, Mapping[str, Any]]) -> list[Any]:
    """The columns of :data:`WEIGHT_COLUMNS`; places over their limit joined by a space."""
    numbers = [shown[place][name] for place in PLACES for name in ("kg", "std_kg")]
    limits = [shown[place]["limit_kg"] for place in PLACES]
    return [*numbers, *limits, " ".join(places_over_limit(shown))]


def places_over_limit(shown: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """The places over their limit in the JSON object of weights."""
    return [place for place in PLACES if shown[place]["is_over_limit"]]


TEXT: Final = FieldKind(str | None, _as_is, _as_is)
FLAG: Final = FieldKind(bool | None, _as_is, _as_is)
WHOLE: Final = FieldKind(int | None, _as_is, _as_is)
COUNT: Final = FieldKind(float | None, float, int)
INSTANT: Final = FieldKind(str | None, iso_utc, ns_of)
NUMBER: Final = FieldKind(float | None, lambda x: rounded(x, 9), float)
ROUGH_NUMBER: Final = FieldKind(float | None, lambda x: rounded(x, 6), float)
INTERVAL: Final = FieldKind(list[float] | None, _interval, tuple, cells=list)
NUMBERS_BY_NAME: Final = FieldKind(
    dict[str, float | None],
    lambda numbers: {name: rounded(x, 6) for name, x in numbers.items()},
    lambda told: {name: math.nan if x is None else x for name, x in told.items()},
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
