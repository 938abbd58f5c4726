"""Logs of broken or absurd sensors through the commands: each has its answer or its error, and nothing else is printed.

Every warning is an error in these tests, so that numpy's, such as "invalid value encountered in divide", end them.
"""

from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.encoded import encode_signals

from gateway.bus.logs.candump_write import write_candump
from gateway.bus.signals import load_signal_map
from gateway.cli import springscale
from gateway.errors import SpringscaleError
from gateway.records import F64, Signal

DEMO = str(files("gateway") / "demo" / "paper_van.json")
MAP = ("--signals", "springscale:reference")
N = 4000  # 40 s at 100 Hz
LENGTHS = (1, 2, 3, 50, 2100)
NOISE = np.random.default_rng(1).standard_normal((3, N))
REST, HELD = np.zeros(N), np.full(N, 14.0)
MOVED = (9.81 + NOISE[0], 0.05 * NOISE[1], 0.05 * NOISE[2], HELD)  # acceleration, pitch rate, roll rate, speed
ONCE = np.where(np.arange(N) == N // 2, 1.0, 0.0)

ODD: dict[str, tuple[F64, F64, F64, F64]] = {
    "all constant": (9.81 + REST, REST, REST, HELD),
    "all zero": (REST, REST, REST, REST),
    "all at the end of their ranges": (32.0 + REST, 2.8 + REST, 2.8 + REST, 100.0 + REST),
    "white noise": MOVED,
    "pitch rate constant": (MOVED[0], REST, REST, HELD),
    "acceleration constant": (9.81 + REST, *MOVED[1:]),
    "one impulse": (9.81 + 20.0 * ONCE, 2.0 * ONCE, REST, HELD),
    "one bit that toggles": (9.81 + 1e-3 * (NOISE[0] > 0.0), 1e-4 * (NOISE[1] > 0.0), REST, HELD),
    "half a drive of nothing": (np.where(np.arange(N) < N // 2, 9.81, MOVED[0]), *MOVED[1:]),
}
STAMPS_S: dict[str, F64] = {
    "one time stamp for all": np.zeros(N),
    "backwards": -np.arange(N) / 100.0,
    "ten in a second": np.arange(N // 10) / 10.0,
    "a day between two": np.arange(20) * 86_400.0,
}


def write(path: Path, samples: tuple[F64, ...], t_s: F64) -> None:
    """A candump log of the reference map."""
    signals = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.ROLL_RATE, Signal.SPEED)
    told = dict(zip(signals, samples, strict=True)) | {Signal.LONGITUDINAL_ACCELERATION: np.zeros(len(t_s))}
    t_ns = np.round((1.7e9 + t_s) * 1e9).astype(np.int64)
    frames = encode_signals(load_signal_map("springscale:reference"), dict.fromkeys(told, t_ns), told)
    write_candump(frames, "can0", path)


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """All of them by name."""
    folder, drive_s = tmp_path_factory.mktemp("odd"), np.arange(N) / 100.0
    wanted: dict[str, tuple[tuple[F64, ...], F64]] = {name: (samples, drive_s) for name, samples in ODD.items()}
    wanted |= {name: (tuple(x[: len(t_s)] for x in MOVED), t_s) for name, t_s in STAMPS_S.items()}
    wanted |= {f"{n} samples": (tuple(x[:n] for x in MOVED), drive_s[:n]) for n in LENGTHS}
    for name, (samples, t_s) in wanted.items():
        write(folder / f"{name}.log", samples, t_s)
    return {name: folder / f"{name}.log" for name in wanted}


NAMES = [*ODD, *STAMPS_S, *(f"{n} samples" for n in LENGTHS)]


def commands(log: Path) -> Iterator[list[str]]:
    yield ["look", str(log)]
    for estimator in ("cross_spectrum", "ratio_index"):
        yield ["estimate", str(log), *MAP, "--calibration", DEMO, "--window-s", "20", "--estimator", estimator]
    yield ["events", str(log), *MAP, "--calibration", DEMO, "--window-s", "20"]


@pytest.mark.parametrize("name", NAMES)
def test_it_ends_with_an_answer_or_a_clear_error(logs: dict[str, Path], name: str) -> None:
    for command in commands(logs[name]):
        done = CliRunner().invoke(springscale, command)
        assert done.exception is None or isinstance(done.exception, SpringscaleError), (command[0], done.exception)
        assert "Warning" not in done.output
