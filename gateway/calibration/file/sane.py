"""Whether a calibration file's numbers are plausible for a vehicle: its hash only proves that they are unchanged."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

LEAST_EIGENVALUE: Final = 1e-12  # of a covariance scaled to ones on its diagonal; less is singular in double precision


@dataclass(frozen=True, slots=True)
class Bound:
    """A row of the table: a field, by its path in the file, and its condition."""

    path: str
    must_be: str
    holds: Callable[[Any], bool]


def absurd(file: Any) -> str | None:
    """The first field whose number is impossible for a vehicle, its value and its condition; None if all are sound.

    A field that is absent from this file, or null, is not checked.
    """
    with np.errstate(all="ignore"):
        for bound in BOUNDS:
            known = _at(file, bound.path)
            if known is not None and not bound.holds(known):
                return f"{bound.path} is {_shown(known)}: it must be {bound.must_be}; calibrate again"
    return None


def _at(file: Any, path: str) -> Any:
    found = file
    for name in path.split("."):
        found = getattr(found, name, None)
    return found


def _shown(known: Any) -> str:
    array = np.asarray(known)
    return f"an array of {' x '.join(map(str, array.shape))}" if array.size > 4 else str(array.tolist())


def _between(low: float, high: float) -> Callable[[Any], bool]:
    return lambda x: bool(np.all(np.asarray(x) > low) and np.all(np.asarray(x) < high))


def _rising(low: float, high: float, *, is_strict: bool = False) -> Callable[[Any], bool]:
    """Pairs of a lower and a higher number, both between these."""

    def holds(pair: Any) -> bool:
        least, most = float(pair[0]), float(pair[1])
        return low <= least and most <= high and (least < most or (not is_strict and least == most))

    return holds


def _bands(pair: Any) -> bool:
    return all(0.0 < centre < 50.0 and 0.0 < width <= 2.0 * centre for centre, width in pair)


def _covariance(matrix: Any) -> bool:
    """Symmetric and positive definite, by its correlations: units differ by many powers of ten."""
    std = np.sqrt(np.diag(matrix))
    if not (np.all(np.isfinite(std)) and np.all(std > 0.0)):
        return False
    scaled = matrix / np.outer(std, std)
    return bool(np.allclose(scaled, scaled.T, atol=1e-6) and np.linalg.eigvalsh(scaled)[0] > LEAST_EIGENVALUE)


def _gram_inverse(matrix: Any) -> bool:
    """Symmetric and positive semidefinite: a regression through loads it knew exactly has zeros."""
    matrix = np.asarray(matrix)
    largest = float(np.abs(matrix).max())
    is_symmetric = np.allclose(matrix, matrix.T, atol=1e-6 * largest)
    return bool(is_symmetric and np.linalg.eigvalsh(matrix)[0] >= -1e-6 * largest)


_SPEEDS: Final = "two speeds above 0 and below 100 m/s, the lower first"
_SHARES: Final = "two shares between 0 and 100 %, the lower first"
_LOADS: Final = "two loads within 100 t, the lower first"
_COVARIANCE: Final = "symmetric and positive definite"
_REGRESSIONS: Final = ("ratio_index.payload", "ratio_index.front_share")

BOUNDS: Final = (
    Bound("seen.payload_kg", _LOADS, _rising(-1e5, 1e5)),
    Bound("seen.front_share_pct", _SHARES, _rising(0.0, 100.0)),
    Bound("seen.speed_mps", _SPEEDS, _rising(1e-3, 100.0)),
    Bound("cross_spectrum.empty_mass_kg", "between 10 kg and 100 t", _between(10.0, 1e5)),
    Bound("cross_spectrum.wheelbase_m", "between 0.3 and 20 m", _between(0.3, 20.0)),
    Bound("cross_spectrum.empty_front_share_pct", "between 0 and 100 %", _between(0.0, 100.0)),
    Bound("cross_spectrum.band_hz", "two frequencies up to 100 Hz, rising", _rising(1e-3, 100.0, is_strict=True)),
    Bound("cross_spectrum.parameters", "within +-50", _between(-50.0, 50.0)),
    Bound("cross_spectrum.covariance", _COVARIANCE, _covariance),
    Bound("cross_spectrum.spread", "between 0.1 and 10", _between(0.1, 10.0)),
    Bound("cross_spectrum.usual_log_amplitude", "within +-50", _between(-50.0, 50.0)),
    Bound("cross_spectrum.payload_seen_kg", _LOADS, _rising(-1e5, 1e5)),
    Bound("cross_spectrum.front_share_seen_pct", _SHARES, _rising(0.0, 100.0)),
    Bound("cross_spectrum.speed_seen_mps", _SPEEDS, _rising(1e-3, 100.0)),
    Bound("ratio_index.acceleration_bands", "centres and widths above 0 Hz", _bands),
    Bound("ratio_index.pitch_rate_bands", "centres and widths above 0 Hz", _bands),
    Bound("ratio_index.speed_range_mps", _SPEEDS, _rising(1e-3, 100.0)),
    *(Bound(f"{one}.gram_inverse", "symmetric and positive semidefinite", _gram_inverse) for one in _REGRESSIONS),
)
