"""How fields of one kind are written in JSON and read back: numbers, intervals, instants, reasons, spectra."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, Final

import numpy as np

from gateway.records import F64, Spectra, Why, iso_utc

NS_PER_US: Final = 1000
_START: Final = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class Kind:
    """How fields of one kind are written, read back and typed. ``read`` never sees null: unknown stays unknown."""

    shape: Any  # for the schema
    write: Callable[[Any], Any]
    read: Callable[[Any], Any]


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
    """The inverse of :func:`spectra_to_json`, as exact as that rounds."""
    names = spectra_to_json(Spectra(*[np.empty(0)] * 5))
    return Spectra(*(np.array([math.nan if x is None else x for x in told[name]]) for name in names))


def _number(x: float, digits: int) -> float | None:
    return float(f"{x:.{digits}g}") if math.isfinite(x) else None


def _numbers(x: F64, digits: int) -> list[float | None]:
    return [_number(float(v), digits) for v in x]


def _interval(bounds: tuple[float, float]) -> list[float] | None:
    low, high = (_number(b, 9) for b in bounds)
    return None if low is None or high is None else [low, high]


def _ns_of(stamp: str) -> int:
    return (datetime.fromisoformat(stamp) - _START) // timedelta(microseconds=1) * NS_PER_US


def _as_is(x: Any) -> Any:
    return x


TEXT: Final = Kind(str | None, _as_is, _as_is)
FLAG: Final = Kind(bool | None, _as_is, _as_is)
WHOLE: Final = Kind(int | None, _as_is, _as_is)
COUNT: Final = Kind(float | None, float, int)
INSTANT: Final = Kind(str | None, iso_utc, _ns_of)
NUMBER: Final = Kind(float | None, lambda x: _number(x, 9), float)
ROUGH_NUMBER: Final = Kind(float | None, lambda x: _number(x, 6), float)
INTERVAL: Final = Kind(list[float] | None, _interval, tuple)
BY_NAME: Final = Kind(
    dict[str, float | None],
    lambda numbers: {name: _number(x, 6) for name, x in numbers.items()},
    lambda told: {name: math.nan if x is None else x for name, x in told.items()},
)
REASONS: Final = Kind(list[str], lambda whys: [str(why) for why in whys], lambda told: tuple(map(Why, told)))
SPECTRA: Final = Kind(dict[str, list[float | None]] | None, spectra_to_json, spectra_from_json)
