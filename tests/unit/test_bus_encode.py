"""The encoder: the decoder's mirror, saturating as a sensor does."""

import numpy as np
import pytest
from support.encoded import encode_signals

from gateway.bus.signals import Decoder, Encoder, load_signal_map
from gateway.bus.signals.signal_map import shipped_maps
from gateway.records import Signal

TYPICAL = {
    Signal.VERTICAL_ACCELERATION: (9.81, 2.0),
    Signal.PITCH_RATE: (0.0, 0.1),
    Signal.ROLL_RATE: (0.0, 0.1),
    Signal.SPEED: (15.0, 1.0),
    Signal.LONGITUDINAL_ACCELERATION: (0.0, 1.0),
    Signal.LATERAL_ACCELERATION: (0.0, 1.0),
    Signal.YAW_RATE: (0.0, 0.1),
    Signal.WHEEL_SPEED: (15.0, 1.0),
    Signal.IGNITION: (1.0, 0.0),
    Signal.LATITUDE: (47.0, 0.1),
    Signal.LONGITUDE: (8.0, 0.1),
    Signal.ODOMETER: (50_000.0, 100.0),
    Signal.DOOR: (1.0, 0.0),
    Signal.AIR_SPRING_PRESSURE: (300_000.0, 50_000.0),
    Signal.TRAILER: (0.0, 0.0),
    Signal.RIDE_HEIGHT: (0.0, 0.02),
    Signal.AXLE_WEIGHT: (800.0, 100.0),
}


def samples_of(signal_map, n=200):
    rng = np.random.default_rng(2)
    samples = {s: rng.normal(*TYPICAL[s], n) for s in signal_map.signals}
    t_ns = {s: np.arange(n, dtype=np.int64) * 10_000_000 for s in signal_map.signals}
    return t_ns, samples


@pytest.mark.parametrize("name", shipped_maps())
def test_what_is_encoded_is_decoded_to_half_a_step(name):
    signal_map = load_signal_map(f"springscale:{name}")
    t_ns, samples = samples_of(signal_map)
    decoder = Decoder(signal_map)
    motion = decoder.decode(encode_signals(signal_map, t_ns, samples))
    for signal in signal_map.signals:
        found_ns, found = motion.of(signal)
        resolution = signal_map.traits[signal].resolution
        step = resolution if np.isfinite(resolution) else 1e-5
        np.testing.assert_array_equal(found_ns, t_ns[signal])
        np.testing.assert_allclose(found, samples[signal], atol=0.5001 * step)
        assert decoder.counts[signal].rejected == {}


def test_samples_beyond_the_bits_saturate():
    signal_map = load_signal_map("springscale:reference")
    frames = Encoder(signal_map).encode("IMU_ACCEL", np.arange(2), {"AccelZ": np.array([1e6, -1e6])})
    found = Decoder(signal_map).decode(frames).of(Signal.VERTICAL_ACCELERATION)[1]
    np.testing.assert_allclose(found, [32.767, -32.768])


def test_signals_not_given_are_zero_and_those_of_valid_when_are_valid():
    signal_map = load_signal_map("springscale:canmod_gps")
    frames = Encoder(signal_map).encode("CANMOD_IMU", np.arange(1), {"AccelerationZ": np.array([9.75])})
    motion = Decoder(signal_map).decode(frames)
    assert motion.of(Signal.VERTICAL_ACCELERATION)[1].tolist() == [9.75]
    assert motion.of(Signal.PITCH_RATE)[1].tolist() == [0.0]


def test_a_given_condition_overrides():
    signal_map = load_signal_map("springscale:canmod_gps")
    frames = Encoder(signal_map).encode("CANMOD_SPEED", np.arange(1), {"SpeedValid": np.zeros(1), "Speed": np.ones(1)})
    assert len(Decoder(signal_map).decode(frames).of(Signal.SPEED)[1]) == 0


def test_what_a_j1939_message_does_not_carry_is_not_available():
    signal_map = load_signal_map("springscale:j1939")
    frames = Encoder(signal_map).encode("ACCS", np.arange(1), {"VerticalAcceleration": np.array([9.81])})
    assert frames.payload[0].tolist() == [0xFF, 0xFF, 0xFF, 0xFF, 0xD5, 0x80, 0xFF, 0xFF]


def test_signals_of_one_message_travel_together():
    signal_map = load_signal_map("springscale:reference")
    t_ns, samples = samples_of(signal_map)
    t_ns[Signal.LONGITUDINAL_ACCELERATION] = t_ns[Signal.LONGITUDINAL_ACCELERATION] + 1
    with pytest.raises(ValueError, match="'IMU_ACCEL' travel together"):
        encode_signals(signal_map, t_ns, samples)


def test_messages_are_merged_in_order_of_time():
    signal_map = load_signal_map("springscale:reference")
    t_ns, samples = samples_of(signal_map, 50)
    for rate in (Signal.PITCH_RATE, Signal.ROLL_RATE, Signal.YAW_RATE):
        t_ns[rate] = t_ns[rate] + 3_000_000
    frames = encode_signals(signal_map, t_ns, samples)
    assert (np.diff(frames.t_ns) >= 0).all()
    assert len(frames) == 50 * 5
