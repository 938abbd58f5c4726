"""The reading speed of each format: the same frames by ours and by python-can's reader."""

import tempfile
from importlib import reload
from itertools import islice
from pathlib import Path
from typing import Any

from benchmarks.speed.bus_log import FORMATS, make_log, write_as
from benchmarks.speed.decode import run_springscale
from benchmarks.speed.meter import best_of, in_own_process

PEER_FRAMES = 50_000  # chosen: python-can is slow


def run_python_can(log: str) -> dict[str, Any]:
    """python-can's reader alone, discarding its messages; its only supported compression is gzip."""
    path = Path(log)
    if path.suffix in {".zst", ".xz"}:
        return {"skipped": "python-can does not read it"}
    import can.io.mf4  # noqa: PLC0415 # after ours, which keeps asammdf out of it (gateway/bus)

    reader: Any = can.LogReader
    if path.suffix == ".mf4":
        import asammdf  # noqa: F401, PLC0415

        reader = reload(can.io.mf4).MF4Reader

    def run() -> dict[str, Any]:
        return {"frames": sum(1 for _ in islice(reader(path), PEER_FRAMES))}

    return best_of(2, run)


RUNS = {"springscale": run_springscale, "python-can": run_python_can}


def measure(minutes: float) -> dict[str, Any]:
    """Both readers on every format."""
    rows: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "bus.log"
        n_frames = make_log(log, minutes)
        for suffix in FORMATS:
            try:
                path = write_as(log, suffix)
            except ModuleNotFoundError as fault:
                rows[suffix] = {"skipped": f"{fault.name} is not installed"}
                continue
            runs = {name: in_own_process(run, path) for name, run in RUNS.items()}
            rows[suffix] = {"bytes_per_frame": path.stat().st_size / n_frames, **runs}
    return {"frames": n_frames, "rows": rows}
