"""The message counter: named in the map, decoded beside its samples, and the clock where stamps are no use."""

from collections.abc import Callable

import numpy as np
import pytest
from support.drives import T0_NS

from gateway.bus.signals.decode import Decoder
from gateway.bus.signals.encode import Encoder
from gateway.bus.signals.signal_map import load_signal_map, shipped_map
from gateway.core.batch import BatchWindow, build_batch
from gateway.core.batch_settings import BatchSettings
from gateway.core.sample_clock import sample_times
from gateway.errors import SignalMapError
from gateway.records import F64, I64, Batch, Bool, Frames, Motion, joined

REFERENCE = load_signal_map("springscale:reference")
DURATION_S = 100.0
N = round(DURATION_S * 100.0)
TAKEN_S = np.arange(N) * 0.01
Counting = Callable[[I64], I64]


def road(seed: int) -> F64:
    """(N,) forty sines from 0.5 to 12 Hz: what a van's body does, exact at any time."""
    rng = np.random.default_rng(seed)
    freq_hz, phase = rng.uniform(0.5, 12.0, 40), rng.uniform(0.0, 2.0 * np.pi, 40)
    return np.sin(2.0 * np.pi * freq_hz * TAKEN_S[:, None] + phase).sum(axis=1)


def frames(stamped_s: F64, kept: Bool, counting: Counting) -> list[Frames]:
    """The frames of both inertial messages and of the speed, with these stamps, without the lost ones."""
    encoder, t_ns = Encoder(REFERENCE), T0_NS + np.rint(stamped_s * 1e9).astype(np.int64)
    speed_mps = 15.0 + 0.2 * np.sin(np.arange(500.0))
    counter = counting(np.arange(N)).astype(float)
    sent = {
        "IMU_ACCEL": {"AccelZ": 9.81 + 0.2 * road(1), "AccelCounter": counter},
        "IMU_GYRO": {"PitchRate": 0.5 * road(2), "GyroCounter": counter},
    }
    inertial = [
        encoder.encode(message, t_ns[kept], {name: x[kept] for name, x in samples.items()})
        for message, samples in sent.items()
    ]
    return [*inertial, encoder.encode("GPS_SPEED", T0_NS + np.arange(500) * 200_000_000, {"Speed": speed_mps})]


def seen(stamped_s: F64, kept: Bool, counting: Counting = lambda k: k % 256) -> Motion:
    decoder = Decoder(REFERENCE)
    motion = joined([decoder.decode(part) for part in frames(stamped_s, kept, counting)])
    return motion.rows(np.argsort(motion.t_ns, kind="stable"))


def batch_of(motion: Motion) -> Batch:
    window = BatchWindow(T0_NS, T0_NS + round(DURATION_S * 1e9), T0_NS)
    return build_batch(motion, window, BatchSettings(window_s=DURATION_S, gap_share_max=0.2), REFERENCE.traits)


def off(one: F64, other: F64) -> float:
    """Root mean square difference over the scatter of the other, away from the ends."""
    middle = slice(200, -200)
    return float(np.sqrt(np.nanmean((one - other)[middle] ** 2)) / np.nanstd(other[middle]))


EVEN = np.ones(N, bool)
HEAPS_40_MS = np.ceil(TAKEN_S / 0.04) * 0.04
LOSSES = np.random.default_rng(5).random(N) > 0.1
LOSSES[[0, -1]] = True
RESETS = np.sort(np.random.default_rng(6).choice(np.arange(1, N), 80, replace=False))


def without_counters(motion: Motion) -> Motion:
    return Motion(motion.signals, motion.t_ns, motion.columns)


def test_heaps_of_40_ms_with_a_tenth_of_the_frames_lost_are_timed_by_the_counter() -> None:
    mean_delay_s = 0.015  # of 0, 10, 20 and 30 ms: nobody can see it
    truth, motion = batch_of(seen(TAKEN_S + mean_delay_s, LOSSES)), seen(HEAPS_40_MS, LOSSES)
    timed, blind = batch_of(motion), batch_of(without_counters(motion))
    assert timed.rejected == ()
    for sensed in ("vertical_acceleration_mps2", "pitch_rate_radps"):
        true = getattr(truth, sensed)
        assert off(getattr(timed, sensed), true) < 0.1
        assert blind.rejected or off(getattr(blind, sensed), true) > 0.5


@pytest.mark.parametrize("kept", [EVEN, LOSSES])
def test_a_counter_changes_nothing_where_stamps_are_good(kept: Bool) -> None:
    motion = seen(TAKEN_S, kept)
    with_counter, without = batch_of(motion), batch_of(without_counters(motion))
    np.testing.assert_array_equal(with_counter.vertical_acceleration_mps2, without.vertical_acceleration_mps2)


NO_COUNTERS: dict[str, Counting] = {
    "stuck": lambda k: 0 * k + 7,
    "stuck most of the time": lambda k: k // 5 % 256,
    "noise": lambda k: np.random.default_rng(3).integers(0, 256, len(k)),
    "a temperature": lambda k: 40 + k // 3000,
    "a swing": lambda k: np.rint(128 + 100 * np.sin(0.2 * k)).astype(np.int64),
    "begins anew now and then": lambda k: (k - np.r_[0, RESETS][np.searchsorted(RESETS, k, side="right")]) % 256,
    "jumps": lambda k: (k + 90 * (k // 700)) % 256,
}


@pytest.mark.parametrize("counting", NO_COUNTERS)
@pytest.mark.parametrize("stamped_s", [TAKEN_S, np.ceil(TAKEN_S / 0.016) * 0.016, HEAPS_40_MS])
def test_a_false_counter_does_no_harm(counting: str, stamped_s: F64) -> None:
    motion = seen(stamped_s, EVEN, NO_COUNTERS[counting])
    with_counter, without = batch_of(motion), batch_of(without_counters(motion))
    assert with_counter.rejected == without.rejected
    np.testing.assert_array_equal(with_counter.vertical_acceleration_mps2, without.vertical_acceleration_mps2)


def ns(t_s: F64) -> I64:
    return T0_NS + np.rint(t_s * 1e9).astype(np.int64)


def step_off_s(found_ns: I64, t_s: F64) -> float:
    """Largest jump of the error from a sample to the next."""
    return float(np.max(np.abs(np.diff((found_ns - ns(t_s)) * 1e-9))))


@pytest.mark.parametrize(("n_bits", "modulus"), [(3, 8), (4, 16), (4, 15), (8, 256), (16, 65536)])
def test_counters_as_devices_have_them(n_bits: int, modulus: int) -> None:
    """Four bits often count from 0 to 14 only (AUTOSAR E2E profile 1)."""
    timing = sample_times(ns(HEAPS_40_MS[LOSSES]), np.arange(N)[LOSSES] % modulus, 1 << n_bits)
    assert step_off_s(timing.t_ns, TAKEN_S[LOSSES]) < 1e-3
    assert timing.n_lost == int(np.count_nonzero(~LOSSES))


def test_a_counter_that_goes_round_within_a_heap_is_passed_over() -> None:
    bits = np.arange(N) % 4
    with_counter, without = sample_times(ns(HEAPS_40_MS), bits, 4), sample_times(ns(HEAPS_40_MS))
    np.testing.assert_array_equal(with_counter.t_ns, without.t_ns)


def test_a_frame_sent_twice_or_overtaken_costs_no_round() -> None:
    arrived = np.r_[np.arange(3000), 2999, np.arange(3000, 6000), 6001, 6000, np.arange(6002, N)]
    stamped_s = np.maximum.accumulate(TAKEN_S[arrived])
    timing = sample_times(ns(stamped_s), arrived % 256, 256)
    assert float(np.max(np.abs(timing.t_ns - ns(TAKEN_S[arrived])))) < 1e6


MAP = '[signals.pitch_rate]\nmessage = "IMU_GYRO"\nsignal = "PitchRate"\n'


@pytest.mark.parametrize(
    ("counter", "words"),
    [
        ("GyroCount", "did you mean 'GyroCounter'?"),
        ("GyroValid", "an integer of 1 bits; a message counter is an integer of 2 to 32 bits"),
        ("AccelCounter", "message 'IMU_GYRO' has no signal 'AccelCounter'"),
    ],
)
def test_a_map_without_a_counter_is_reported(counter: str, words: str, tmp_path) -> None:
    dbc = shipped_map("reference").with_name("springscale_reference.dbc")
    path = tmp_path / "signals.toml"
    path.write_text(f'dbc = ["{dbc}"]\n{MAP}counter = "{counter}"\n')
    with pytest.raises(SignalMapError, match=r"signals\.pitch_rate\.counter") as fault:
        load_signal_map(path)
    assert words in str(fault.value)
