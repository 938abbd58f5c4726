"""A fake IIO device: a sysfs tree as the kernel's, and a FIFO in place of the character device."""

import os
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

ACCEL_SCALE = 0.000598  # of an MPU-6050 at 2 g, m/s2 a digit
GYRO_SCALE = 0.00013316  # rad/s a digit
Scan = tuple[tuple[int, int, int], tuple[int, int, int], int]


class FakeIio:
    """An MPU-6050 as its driver shows it: big-endian 16 bits, accelerometer, temperature, gyroscope, time stamp."""

    def __init__(self, folder: Path, name: str = "mpu6050", *, has_gyro: bool = True) -> None:
        self.sysfs, self.nodes = folder / "sys", folder / "dev"
        device = self.sysfs / "iio:device0"
        (device / "scan_elements").mkdir(parents=True)
        (device / "buffer").mkdir()
        self.nodes.mkdir()
        self.device = device
        self._has_gyro = has_gyro
        texts = {
            "name": name,
            "sampling_frequency": "50",
            "sampling_frequency_available": "10 20 50 100 200 500",
            "current_timestamp_clock": "monotonic",
            "in_accel_scale": str(ACCEL_SCALE),
            "in_anglvel_scale": str(GYRO_SCALE),
            "buffer/enable": "0",
            "buffer/length": "2",
            "buffer/watermark": "1",
        }
        channels = [("in_accel_x", 0), ("in_accel_y", 1), ("in_accel_z", 2), ("in_temp", 3)]
        channels += [("in_anglvel_x", 4), ("in_anglvel_y", 5), ("in_anglvel_z", 6)] if has_gyro else []
        for channel, index in channels:
            texts |= {f"scan_elements/{channel}_en": "1" if channel == "in_temp" else "0"}
            texts |= {f"scan_elements/{channel}_index": str(index), f"scan_elements/{channel}_type": "be:s16/16>>0"}
        texts |= {
            "scan_elements/in_timestamp_en": "0",
            "scan_elements/in_timestamp_index": "7",
            "scan_elements/in_timestamp_type": "le:s64/64>>0",
        }
        for path, text in texts.items():
            (device / path).write_text(text + "\n")
        self.node = self.nodes / "iio:device0"
        os.mkfifo(self.node)

    def text(self, name: str) -> str:
        return (self.device / name).read_text().strip()

    def packed(self, scan: Scan) -> bytes:
        """One scan: the temperature is switched off by then; the stamp lies at a multiple of eight."""
        accel, gyro, t_ns = scan
        words = struct.pack(">3h", *accel) + (struct.pack(">3h", *gyro) if self._has_gyro else b"")
        return words + b"\0" * (-len(words) % 8) + struct.pack("<q", t_ns)

    @contextmanager
    def sampling(self, rate_hz: float, scan: Callable[[int], Scan | None]) -> Iterator[None]:
        """Write scans at this rate for as long as somebody reads; None is a sample that was lost."""
        stopping = threading.Event()

        def write() -> None:
            with self.node.open("wb", buffering=0) as fifo:
                begun_s, i = time.monotonic(), 0
                while not stopping.is_set():
                    if (one := scan(i)) is not None:
                        try:
                            fifo.write(self.packed(one))
                        except BrokenPipeError:
                            return
                    i += 1
                    time.sleep(max(0.0, begun_s + i / rate_hz - time.monotonic()))

        writer = threading.Thread(target=write, daemon=True)
        writer.start()
        try:
            yield
        finally:
            stopping.set()
            if writer.is_alive() and not writer.join(2.0) and writer.is_alive():
                os.close(os.open(self.node, os.O_RDONLY | os.O_NONBLOCK))  # nobody ever read
