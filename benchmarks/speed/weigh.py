"""The cost of weighing: one batch of five minutes by each estimator, a calibration on ten drives of 15 minutes, and a
commissioning in the vehicle.

    python -m benchmarks.speed.weigh [--json]

The batch is the demo's, with a roll rate; the campaign is the paper's experiment, simulated first.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, Final

from benchmarks.speed import commissioning
from benchmarks.speed.meter import ONE_THREAD, best_of, cpu_s
from gateway.bus.signals import Decoder
from gateway.config import ESTIMATOR_NAMES
from gateway.core.estimator import estimate
from gateway.core.settings import BatchSettings
from gateway.offline.campaigns import batches_of_motion
from gateway.setup import load_setup
from gateway.workbench import demo_drive, frames_of

CALIBRATION: Final = Path(__file__).parents[2] / "gateway" / "demo" / "paper_van.json"


def batch_s() -> dict[str, float]:
    """CPU time of one estimate, by estimator: the mean over the batches of the demo's drive."""
    setup = load_setup("springscale:reference", CALIBRATION)
    motion = Decoder(setup.signal_map).decode(frames_of(demo_drive()))
    batches = [b for b in batches_of_motion(motion, setup.signal_map, BatchSettings()) if not b.is_provisional]
    sound = [batch for batch in batches if not batch.rejected]

    def weigh_all(name: str) -> dict[str, Any]:
        return {"counted": sum(estimate(batch, setup.calibrated, name).counted for batch in sound)}

    return {name: best_of(3, lambda name=name: weigh_all(name))["seconds"] / len(sound) for name in ESTIMATOR_NAMES}  # type: ignore[misc] # a default binds the loop's name


def fits() -> dict[str, dict[str, float]]:
    """CPU and clock time of `springscale calibrate` on ten drives, and of a commissioning on the vehicle's line."""
    with tempfile.TemporaryDirectory() as name:
        campaign, line = Path(name) / "campaign.toml", Path(name) / "vehicle.json"
        _springscale("simulate", "campaign", "experiment", name)
        begun_s, begun_cpu_s = time.monotonic(), cpu_s()
        _springscale("calibrate", str(campaign), "--output", str(line))
        calibration = {"cpu_s": cpu_s() - begun_cpu_s, "clock_s": time.monotonic() - begun_s}
        return {"calibration": calibration, "commissioning": commissioning.measure(campaign, line, Path(name) / "job")}


def _springscale(*arguments: str) -> None:
    command = [sys.executable, "-m", "gateway", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | ONE_THREAD)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}: {done.stderr}")


def measure() -> dict[str, Any]:
    """All of it."""
    return {"batch_s": batch_s(), **fits()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true", help="print the figures for machines")
    options = parser.parse_args()
    print(json.dumps(measure(), indent=None if options.json else 1))


if __name__ == "__main__":
    main()
