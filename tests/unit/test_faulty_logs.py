"""What the study of sensor faults does to a log, read back by the signal map."""

import numpy as np
import pytest
from support.encoded import encode_signals

from benchmarks.accuracy.faulty_logs import ACCELERATION, FAULTS, PITCH_RATE, ROLL_RATE, SPEED, Fault, Log
from gateway.bus.signals import load_signal_map
from gateway.records import F64, Signal
from gateway.units import NS_PER_S

RATE_HZ = 100.0
N = 12_000  # two minutes


@pytest.fixture(scope="module")
def log() -> Log:
    signal_map = load_signal_map("springscale:reference")
    rng, t_ns = np.random.default_rng(1), np.arange(N) * round(NS_PER_S / RATE_HZ)
    t_s = t_ns / NS_PER_S
    samples = {
        ACCELERATION: 9.81 + 2.0 * rng.standard_normal(N),
        PITCH_RATE: 0.2 * np.sin(2.0 * np.pi * 2.0 * t_s),
        ROLL_RATE: 0.05 * np.sin(2.0 * np.pi * 1.5 * t_s),
        SPEED: 15.0 + 10.0 * np.sin(t_s),
    }
    return Log(encode_signals(signal_map, dict.fromkeys(samples, t_ns), samples), signal_map)


def after(log: Log, name: str, strength: str = "") -> Log:
    """The log with one fault."""
    (fault,) = (one for one in FAULTS if (one.name, one.strength) == (name, strength))
    return fault.rewrite(log, np.random.default_rng(2))


def both(log: Log, signal: Signal, name: str, strength: str = "") -> tuple[F64, F64]:
    """Samples before and after."""
    return log.samples(signal)[1], after(log, name, strength).samples(signal)[1]


def step(log: Log, signal: Signal) -> float:
    return log.mapped(signal)[0].resolution


@pytest.mark.parametrize("fault", FAULTS, ids=lambda one: one.id)
def test_every_fault_changes_what_it_names_and_nothing_else(log: Log, fault: Fault) -> None:
    rewritten = fault.rewrite(log, np.random.default_rng(2))
    assert np.all(np.diff(rewritten.frames.t_ns) >= 0)
    if len(rewritten.frames) != len(log.frames):
        return
    untouched = {ACCELERATION, PITCH_RATE, ROLL_RATE, SPEED} - {*fault.signals}
    for signal in untouched:
        np.testing.assert_array_equal(rewritten.samples(signal)[1], log.samples(signal)[1])
    is_same = np.array_equal(rewritten.frames.payload, log.frames.payload)
    assert is_same == (fault is FAULTS[0])


def test_a_gain_a_bias_and_a_sign(log: Log) -> None:
    before, weaker = both(log, ACCELERATION, "acceleration times", "0.8")
    np.testing.assert_allclose(weaker, 0.8 * before, atol=step(log, ACCELERATION))
    before, biased = both(log, PITCH_RATE, "pitch rate biased by", "0.1 rad/s")
    np.testing.assert_allclose(biased, before + 0.1, atol=step(log, PITCH_RATE))
    before, over = both(log, PITCH_RATE, "pitch rate turned over")
    np.testing.assert_allclose(over, -before, atol=step(log, PITCH_RATE))


def test_frames_are_lost_doubled_and_sent_by_two(log: Log) -> None:
    n = len(log.frames)
    assert len(after(log, "frames dropped", "20%").frames) == pytest.approx(0.8 * n, rel=0.02)
    assert len(after(log, "frames doubled", "100%").frames) == 2 * n
    of_two = after(log, "two devices on one identifier", "one at 0.9")
    t_s, x = of_two.samples(ACCELERATION)
    assert len(x) == 2 * N
    second = np.isclose(t_s % (1.0 / RATE_HZ), 0.004, atol=1e-6)
    np.testing.assert_allclose(x[second], 0.9 * x[~second], atol=step(log, ACCELERATION))
