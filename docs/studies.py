"""What hardware.md and phone.md say of studies: sensor-grades.json and phone_accuracy.json.

`python -m benchmarks.accuracy sensor-grades --output docs` and `python -m benchmarks.accuracy phones --output docs`.
"""

import json
from collections.abc import Mapping
from typing import Any

from made import ROOT

from benchmarks.accuracy.phones import BY_PHONE, CAN


def phone_beside_can() -> str:
    """How a phone's errors and intervals compare with a CAN IMU's."""
    rows = {row["sensor"]: row["payload"] for row in _numbers("phone_accuracy")["rows"]}
    phone, can = rows[BY_PHONE], rows[CAN]
    return (
        f"On the same simulated drives [a phone](phone_accuracy.md) errs by {phone['mean_abs_kg']:.1f} kg in the mean, "
        f"a CAN IMU by {can['mean_abs_kg']:.1f} kg; half its 95 % interval is {phone['half_width_kg']:.0f} kg, the CAN "
        f"IMU's {can['half_width_kg']:.0f} kg.\n"
    )


def _numbers(name: str) -> Mapping[str, Any]:
    found: Mapping[str, Any] = json.loads((ROOT / f"docs/{name}.json").read_text(encoding="utf-8"))
    return found
