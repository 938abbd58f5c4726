"""An estimate as a line for people."""

from collections.abc import Mapping, Sequence
from typing import Any

from gateway.units import si_factor


def sentence(record: Mapping[str, Any]) -> str:
    """One line of the object of ``estimate_to_json``: when, how much, how sure; or why not."""
    when = f"{record['t_start'][:19]}Z"
    if record["rejected"]:
        return f"{when}  no estimate: {', '.join(record['rejected'])}"
    return (
        f"{when}  payload {record['payload_kg']:7.1f} kg ± {_half(record['payload_interval95_kg']):5.1f} (95 %)   "
        f"front share {record['front_share_pct']:5.2f} % ± {_half(record['front_share_interval95_pct']):4.2f} (95 %)   "
        f"{_aside(record)}{record['mean_speed_mps'] / si_factor('speed', 'km/h'):5.1f} km/h"
        f"{_too_much(record)}"
    )


def _aside(record: Mapping[str, Any]) -> str:
    """Where the sprung mass lies sideways, where something tells."""
    if record["cg_left_m"] is None:
        return ""
    half_mm = 1000.0 * _half(record["cg_left_interval95_m"])
    return f"{1000.0 * record['cg_left_m']:+5.0f} mm left ± {half_mm:3.0f} (95 %)   "


def _too_much(record: Mapping[str, Any]) -> str:
    """Which places bear more than they may."""
    over = [place.replace("_", " ") for place, weight in record["weights"].items() if weight["is_over_limit"]]
    return f"   over the limit: {', '.join(over)}" if over else ""


def _half(interval95: Sequence[float]) -> float:
    """Half its width: what stands behind ±."""
    return (interval95[1] - interval95[0]) / 2.0
