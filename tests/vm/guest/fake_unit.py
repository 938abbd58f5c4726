"""An inertial unit as Linux IIO shows it, with a FIFO for its device, below the folder named: level, at rest, 50 Hz.

Runs until it is killed: whoever reads then finds the device gone.
"""

import os
import shutil
import struct
import sys
import time
from pathlib import Path

RATE_HZ = 50
ONE_G = 16_384

folder = Path(sys.argv[1])
device, node = folder / "sys/iio:device0", folder / "dev/iio:device0"
shutil.rmtree(folder, ignore_errors=True)
texts = {"name": "mpu6050", "sampling_frequency": str(RATE_HZ), "current_timestamp_clock": "monotonic"}
texts |= {"in_accel_scale": "0.000598", "in_anglvel_scale": "0.00013316", "buffer/enable": "0", "buffer/length": "2"}
channels = [f"in_{kind}_{axis}" for kind in ("accel", "anglvel") for axis in "xyz"]
for index, channel in enumerate([*channels, "in_timestamp"]):
    kind = "le:s64/64>>0" if channel == "in_timestamp" else "be:s16/16>>0"
    for what, text in (("en", "0"), ("index", str(index)), ("type", kind)):
        texts[f"scan_elements/{channel}_{what}"] = text
for path, text in texts.items():
    (device / path).parent.mkdir(parents=True, exist_ok=True)
    (device / path).write_text(text)
node.parent.mkdir()
os.mkfifo(node)
for each in (folder, *folder.rglob("*")):  # what deploy/60-springscale-iio.rules does to a real one
    shutil.chown(each, group="springscale")
    each.chmod(0o770 if each.is_dir() else 0o660)

with node.open("wb", buffering=0) as fifo:
    while True:
        fifo.write(struct.pack(">6h", 0, 0, ONE_G, 0, 0, 0) + bytes(4) + struct.pack("<q", time.time_ns()))
        time.sleep(1 / RATE_HZ)
