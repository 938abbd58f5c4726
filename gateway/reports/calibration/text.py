"""How a report writes numbers and names."""

from typing import Final

NONE: Final = "–"
_DIGITS: Final = 2  # chosen


def decimal(number: float | None, unit: str = "", digits: int = _DIGITS) -> str:
    """Two digits after the point; a dash where there is none."""
    return NONE if number is None else f"{number:.{digits}f}{unit}"


def percent(share: float | None) -> str:
    """A share (0..1) in percent."""
    return NONE if share is None else f"{100.0 * share:.0f} %"


def estimator_name(estimator: str) -> str:
    """As people call it."""
    return {"cross_spectrum": "cross-spectral estimator", "ratio_index": "ratio index"}.get(estimator, estimator)


def span(low: float, high: float, unit: str, digits: int = 0) -> str:
    """ "0 to 420 kg", or "0 kg" where that is all."""
    if f"{low:.{digits}f}" == f"{high:.{digits}f}":
        return f"{low:.{digits}f} {unit}"
    return f"{low:.{digits}f} to {high:.{digits}f} {unit}"
