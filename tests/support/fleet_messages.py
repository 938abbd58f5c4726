"""Messages as the vans of a fleet send them."""

import json
from typing import Any

from gateway.fleet import Message


def message(vehicle: str, branch: str, **told: Any) -> Message:
    return Message(f"springscale/{vehicle}/{branch}", json.dumps(told).encode())


def estimate(vehicle: str, minute: int, payload_kg: float, *rejected: str, limit_kg: float = 2000.0) -> Message:
    kg = {"kg": 1500.0 + payload_kg, "std_kg": 9.0, "limit_kg": limit_kg}
    gross = {**kg, "is_over_limit": payload_kg > limit_kg - 1500.0}
    told: dict[str, Any] = {
        "payload_kg": payload_kg,
        "payload_interval95_kg": [payload_kg - 18.0, payload_kg + 18.0],
        "weights": {"gross": gross},
    }
    answer = told if not rejected else {"payload_kg": None}
    t_end = f"2027-01-15T07:{minute:02}:00Z"
    return message(vehicle, "estimates", id=f"e-{minute}", t_end=t_end, rejected=list(rejected), **answer)


def alarm(vehicle: str, revision: int, *, is_active: bool) -> Message:
    told = {"kind": "overload", "where": "gross", "t_start": "2027-01-15T07:50:00Z"}
    return message(vehicle, "alarms", id="alarm-1", revision=revision, is_active=is_active, **told)
