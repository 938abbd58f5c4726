"""A real gpsd, fed NMEA over TCP, in front of the feed."""

import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import can
import pytest
from support.parts import found, needs
from support.patience import wait_until
from support.ports import free_port

from gateway.bus.feeder import Feeder, Gpsd
from gateway.bus.frames import frames_of
from gateway.bus.signals import Decoder, load_signal_map
from gateway.records import Signal

KNOTS = 1852.0 / 3600.0


def sentence(body: str) -> bytes:
    """An NMEA 0183 sentence with its sum."""
    total = 0
    for byte in body.encode():
        total ^= byte
    return f"${body}*{total:02X}\r\n".encode()


def epoch(n: int, speed_mps: float, *, has_fix: bool = True) -> bytes:
    """A second of a receiver: time, place and speed; satellites used."""
    at = f"{n // 3600 % 24:02d}{n // 60 % 60:02d}{n % 60:02d}.00"
    knots = speed_mps / KNOTS
    if not has_fix:
        return sentence(f"GPRMC,{at},V,,,,,,,211126,,,N") + sentence(f"GPGGA,{at},,,,,0,00,,,M,,M,,")
    place = "4530.0000,N,12215.0000,W"
    return (
        sentence(f"GPRMC,{at},A,{place},{knots:.3f},90.0,211126,,,A")
        + sentence(f"GPGGA,{at},{place},1,09,0.9,100.0,M,0.0,M,,")
        + sentence("GPGSA,A,3,01,02,03,04,05,06,07,08,09,,,,1.5,0.9,1.2")
        + b"".join(
            sentence(
                f"GPGSV,3,{1 + i // 4},09,"
                + ",".join(f"{k:02d},40,{10 * k:03d},45" for k in range(i + 1, min(i + 5, 10)))
            )
            for i in (0, 4, 8)
        )
    )


@contextmanager
def receiver(speeds: list[float | None]) -> Iterator[int]:
    """A port at which an NMEA receiver tells these speeds, ten a second, and then the last one for ever."""
    listener = socket.create_server(("127.0.0.1", 0))
    stopping = threading.Event()

    def talk() -> None:
        connection, _ = listener.accept()
        n = 43_200
        with connection:
            while not stopping.is_set():
                speed = speeds[min(n - 43_200, len(speeds) - 1)]
                try:
                    connection.sendall(epoch(n, speed or 0.0, has_fix=speed is not None))
                except OSError:
                    return
                n += 1
                time.sleep(0.1)

    threading.Thread(target=talk, daemon=True).start()
    try:
        yield listener.getsockname()[1]
    finally:
        stopping.set()
        listener.close()


@needs("gpsd")
def test_readings_of_the_receiver_are_sent_to_the_bus(tmp_path: Path) -> None:
    port = free_port()
    heard: list[can.Message] = []
    program = found("gpsd")
    assert program is not None
    with receiver([None] * 5 + [13.9] * 20 + [25.0]) as nmea, (tmp_path / "gpsd.log").open("wb") as log:
        gpsd = subprocess.Popen([program, "-N", "-n", "-S", str(port), f"tcp://127.0.0.1:{nmea}"], stderr=log)
        feeder = Feeder("virtual", "feed-gpsd", [], Gpsd("127.0.0.1", port), print)
        thread = threading.Thread(target=feeder.run)
        with can.Bus(interface="virtual", channel="feed-gpsd") as bus:
            notifier = can.Notifier(bus, [heard.append])
            thread.start()
            try:
                decoder = Decoder(load_signal_map("springscale:reference"))

                def speeds() -> list[float]:
                    return [round(x, 1) for x in decoder.decode(frames_of(list(heard), 8)).of(Signal.SPEED)[1].tolist()]

                assert wait_until(lambda: 25.0 in speeds()), (tmp_path / "gpsd.log").read_text()
                assert 13.9 in speeds()
                rows = decoder.decode(frames_of(list(heard), 8))
                assert rows.of(Signal.LATITUDE)[1][-1] == pytest.approx(45.5)
                assert rows.of(Signal.LONGITUDE)[1][-1] == pytest.approx(-122.25)
                assert max(message.data[2] for message in heard if message.arbitration_id == 0x130) == 9
            finally:
                feeder.stop()
                thread.join()
                notifier.stop()
                gpsd.terminate()
                gpsd.wait()
