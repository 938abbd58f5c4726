"""How `springscale reprocess` uses the cores: a small fleet's logs by one process, then by one for each core.

Each vehicle's log is two hours of the demo's drive, again and again; estimated by cross_spectrum. Time by the clock,
the start of the processes included, both runs one after the other with nothing else changed.
"""

import json
import os
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from benchmarks.speed.meter import CALIBRATION, springscale
from gateway.bus.logs.candump_write import append_candump
from gateway.units import NS_PER_S
from gateway.workbench.simulated_drives import demo_drive, frames_of

HOURS: Final = 2.0  # chosen: of each log
MANIFEST: Final = """\
signals = "springscale:reference"
calibration = "vehicle.json"
"""


def write_archive(folder: Path, n_vehicles: int) -> int:
    """A folder and one log for each vehicle, and the manifest -> frames written."""
    drive = frames_of(demo_drive())
    span_ns = int(drive.t_ns[-1] - drive.t_ns[0]) + 20 * NS_PER_S
    n_drives = max(1, round(HOURS * 3600 * NS_PER_S / span_ns))
    vehicles = [f"van-{n}" for n in range(1, n_vehicles + 1)]
    for vehicle in vehicles:
        (folder / vehicle).mkdir()
        with (folder / vehicle / "drive.log").open("wb") as file:
            for n in range(n_drives):
                append_candump(replace(drive, t_ns=drive.t_ns + n * span_ns), "can0", file)
    shutil.copy(CALIBRATION, folder / "vehicle.json")
    entries = "".join(f'[[vehicles]]\nid = "{vehicle}"\n' for vehicle in vehicles)
    (folder / "archive.toml").write_text(MANIFEST + entries)
    return len(drive) * n_drives * n_vehicles


def reprocess(archive: Path, dataset: Path, n_workers: int) -> dict[str, float]:
    """Wall time and batches of one run."""
    ran = springscale("reprocess", archive, "--output", dataset, "--workers", n_workers, "--json")
    return {"clock_s": ran["clock_s"], "batches": json.loads(ran["output"])["n_batches"]}


def measure(n_vehicles: int) -> dict[str, Any]:
    """One process, then as many as there are cores."""
    n_cores = len(os.sched_getaffinity(0))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "archive").mkdir()
        n_frames = write_archive(folder / "archive", n_vehicles)
        runs = {str(n): reprocess(folder / "archive", folder / f"by-{n}", n) for n in (1, n_cores)}
    return {"vehicles": n_vehicles, "hours": HOURS, "frames": n_frames, "cores": n_cores, "workers": runs}
