"""An estimate as a line for people."""

from collections.abc import Mapping, Sequence
from typing import Any

from gateway.units import si_factor


def sentence(record: Mapping[str, Any]) -> str:
    """One line of the object of ``estimate_to_json``: when, how much, with its interval; or why not."""
    when = f"{record['t_start'][:19]}Z"
    if record["rejected"]:
        return f"{when}  no estimate: {', '.join(record['rejected'])}"
    payload = _told(record, "payload", "kg", "7.1f", "5.1f")
    front_share = _told(record, "front_share", "pct", "5.2f", "4.2f")
    speed_kmh = record["mean_speed_mps"] / si_factor("speed", "km/h")
    return f"{when}  {payload}   {front_share}   {_aside(record)}{speed_kmh:5.1f} km/h{_too_much(record)}"


def _told(record: Mapping[str, Any], name: str, unit: str, form: str, half_form: str) -> str:
    """A quantity and half its interval; a calibration may contain one of the two alone."""
    words, number = name.replace("_", " "), record[f"{name}_{unit}"]
    if number is None:
        return f"{words} unknown"
    half = _half(record[f"{name}_interval95_{unit}"])
    return f"{words} {number:{form}} {'%' if unit == 'pct' else unit} ± {half:{half_form}} (95 %)"


def _aside(record: Mapping[str, Any]) -> str:
    """The lateral position of the sprung mass, if known."""
    if record["cg_left_m"] is None:
        return ""
    half_mm = 1000.0 * _half(record["cg_left_interval95_m"])
    return f"{1000.0 * record['cg_left_m']:+5.0f} mm left ± {half_mm:3.0f} (95 %)   "


def _too_much(record: Mapping[str, Any]) -> str:
    """The places over their limit."""
    over = [place.replace("_", " ") for place, weight in record["weights"].items() if weight["is_over_limit"]]
    return f"   over the limit: {', '.join(over)}" if over else ""


def _half(interval95: Sequence[float]) -> float:
    """Half its width: the number after ±."""
    return (interval95[1] - interval95[0]) / 2.0
