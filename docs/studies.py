"""Sentences of hardware.md and phone.md about studies, from sensor-grades.json and phone_accuracy.json.

`python -m benchmarks.accuracy sensor-grades --output docs` and `python -m benchmarks.accuracy phones --output docs`
make them.
"""

import json
import sys
from collections.abc import Mapping
from typing import Any

from made import ROOT

sys.path.insert(0, str(ROOT))
from benchmarks.accuracy.grades import limits  # benchmarks are not installed
from benchmarks.accuracy.phones import BY_PHONE, CAN


def noise_that_works() -> str:
    """The noisiest sensors that weigh as well as the simulated one."""
    return limits(_numbers("sensor-grades"))


def phone_beside_can() -> str:
    """A phone's errors and intervals beside a CAN IMU's."""
    rows = {row["sensor"]: row["payload"] for row in _numbers("phone_accuracy")["rows"]}
    phone, can = rows[BY_PHONE], rows[CAN]
    return (
        f"On the same simulated drives [a phone](phone_accuracy.md) errs by {phone['mean_abs_kg']:.1f} kg on average, "
        f"a CAN IMU by {can['mean_abs_kg']:.1f} kg; half its 95 % interval is {phone['half_width_kg']:.0f} kg, the CAN "
        f"IMU's {can['half_width_kg']:.0f} kg.\n"
    )


def _numbers(name: str) -> Mapping[str, Any]:
    found: Mapping[str, Any] = json.loads((ROOT / f"docs/{name}.json").read_text(encoding="utf-8"))
    return found
