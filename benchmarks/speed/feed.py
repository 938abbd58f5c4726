"""The processor time and memory of `springscale feed`, on a fake device with a FIFO.

python -m benchmarks.speed.feed --output docs/feed_cost.json
"""

import json
import os
import struct
import threading
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from benchmarks.speed.meter import machine, print_and_write, springscale

RATE_HZ: Final = 100.0  # chosen: of the fake device
SHORT_S: Final = 5.0  # chosen: the difference of both runs is the cost of feeding without the start
LONG_S: Final = 35.0  # chosen: of the long run


def _device(folder: Path) -> Path:
    """A sysfs tree of a unit with six channels and a stamp, big-endian; its FIFO."""
    device = folder / "sys/iio:device0"
    (device / "scan_elements").mkdir(parents=True)
    (device / "buffer").mkdir()
    (folder / "dev").mkdir()
    texts = {"name": "mpu6050", "buffer/enable": "0", "buffer/length": "2", "in_accel_scale": "0.000598"}
    texts |= {"in_anglvel_scale": "0.00013316", "sampling_frequency": f"{RATE_HZ:g}"}
    channels = [f"in_{kind}_{axis}" for kind in ("accel", "anglvel") for axis in "xyz"]
    for index, channel in enumerate([*channels, "in_timestamp"]):
        kind = "le:s64/64>>0" if channel == "in_timestamp" else "be:s16/16>>0"
        for what, text in (("en", "0"), ("index", str(index)), ("type", kind)):
            texts[f"scan_elements/{channel}_{what}"] = text
    for path, text in texts.items():
        (device / path).write_text(text)
    os.mkfifo(folder / "dev/iio:device0")
    return folder / "dev/iio:device0"


def _write_samples(fifo: Path) -> None:
    """A sample every hundredth of a second until nobody reads."""
    with fifo.open("wb", buffering=0) as file:
        begun_s, begun_ns = time.monotonic(), time.time_ns()
        i = 0
        while True:
            stamp = begun_ns + round(i * 1e9 / RATE_HZ)
            words = struct.pack(">6h", i % 50, 0, 16_400 + i % 97, i % 31, i % 17, 0)
            try:
                file.write(words + b"\0" * 4 + struct.pack("<q", stamp))
            except BrokenPipeError:
                return
            i += 1
            time.sleep(max(0.0, begun_s + i / RATE_HZ - time.monotonic()))


def _feed(for_s: float) -> dict[str, Any]:
    with TemporaryDirectory() as folder:
        writer = threading.Thread(target=_write_samples, args=(_device(Path(folder)),), daemon=True)
        writer.start()
        options = ["--interface", "virtual", "--channel", "bench", "--gpsd", "", "--for-s", for_s, "--json"]
        return springscale("feed", *options, "--sysfs", f"{folder}/sys", "--nodes", f"{folder}/dev")


def measure() -> dict[str, Any]:
    """The feed for two lengths of time."""
    short, long = _feed(SHORT_S), _feed(LONG_S)
    told = json.loads(long["output"])
    return {
        "rate_hz": RATE_HZ,
        "frames_per_s": told["sent"] / LONG_S,
        "told": told,
        "cpu_pct": 100.0 * (long["cpu_s"] - short["cpu_s"]) / (LONG_S - SHORT_S),
        "rss_mb": long["peak_mb"],
        "machine": machine(),
    }


if __name__ == "__main__":
    print_and_write(__doc__, measure)
