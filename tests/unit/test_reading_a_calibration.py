"""Who only reads a calibration loads nothing that fits one: a vehicle has no memory to spare."""

import subprocess
import sys

from support.patience import PATIENCE_S

FITTING = ("gateway.calibration.half_car", "gateway.calibration.ratio_index", "gateway.calibration.line")


def test_the_file_knows_nothing_of_the_fit() -> None:
    command = (
        f"import sys, gateway.calibration.file; print([name for name in sys.modules if name.startswith({FITTING})])"
    )
    said = subprocess.run(
        [sys.executable, "-c", command], capture_output=True, text=True, timeout=PATIENCE_S, check=True
    ).stdout
    assert said.strip() == "[]"
