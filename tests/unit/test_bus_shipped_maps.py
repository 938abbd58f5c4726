"""Every shipped map loads and decodes a frame worked out by hand from the device's facts."""

import math
import struct

import pytest
from support.encoded import frames_of

from gateway.bus.signals import Decoder, load_signal_map
from gateway.bus.signals.mapping import CLASSIC_BYTES
from gateway.bus.signals.signal_map import shipped_maps
from gateway.records import EXTENDED_ID, Signal

RAD = math.pi / 180
A, P, R, V, W, X, Y, TURN, LAT, LON, ODO, ON, DOOR, AIR = (
    Signal.VERTICAL_ACCELERATION,
    Signal.PITCH_RATE,
    Signal.ROLL_RATE,
    Signal.SPEED,
    Signal.WHEEL_SPEED,
    Signal.LONGITUDINAL_ACCELERATION,
    Signal.LATERAL_ACCELERATION,
    Signal.YAW_RATE,
    Signal.LATITUDE,
    Signal.LONGITUDE,
    Signal.ODOMETER,
    Signal.IGNITION,
    Signal.DOOR,
    Signal.AIR_SPRING_PRESSURE,
)


def bits(*fields, length=8):
    """Little-endian payload from (start bit, raw number)."""
    return sum(raw << start for start, raw in fields).to_bytes(length, "little")


J1939_FRAMES = [
    # vertical raw 32981: 329.81 - 320 = 9.81; longitudinal raw 31950: -0.5; lateral not available
    (0x0CF02D80 | EXTENDED_ID, struct.pack("<HHHH", 0xFFFF, 31950, 32981, 0xFFFF), {A: 9.81, X: -0.5}),
    # bytes 3-4: 72 km/h x 256
    (0x18FEE81C | EXTENDED_ID, bits((0, 0xFFFF), (16, 72 * 256), (32, 0xFFFFFFFF)), {V: 20.0}),
    # bytes 2-3: 90 km/h x 256
    (0x0CFEF100 | EXTENDED_ID, bits((0, 0xF3), (8, 90 * 256), (24, 0xFFFFFFFFFF)), {W: 25.0}),
    # (45.5 + 210) x 1e7 and (-122.25 + 210) x 1e7
    (0x18FEF3FE | EXTENDED_ID, struct.pack("<II", 2_555_000_000, 877_500_000), {LAT: 45.5, LON: -122.25}),
    # 5 m a bit; the trip's distance is not available
    (0x18FEC1FE | EXTENDED_ID, struct.pack("<II", 24_691_357, 0xFFFFFFFF), {ODO: 123_456_785.0}),
    # bits 1 to 4: 0 at least one open, 1 the last one closing, 2 all closed, 15 not available
    *(
        (0x18FE4EFE | EXTENDED_ID, bits((0, raw), (4, 0xF)), told)
        for raw, told in ((0, {DOOR: 1.0}), (1, {DOOR: 0.5}), (2, {DOOR: 0.0}), (3, {}), (14, {}), (15, {}))
    ),
    # the third of four pressures, 0.1 kPa a bit: 412 kPa
    (0x18FE5830 | EXTENDED_ID, struct.pack("<HHHH", 0xFFFF, 2000, 4120, 4300), {AIR: 412_000.0}),
]
# -250 deg/s + raw / 128: raw 32256 is 2 deg/s, raw 31360 is -5 deg/s
J1939_RATES = (0x18F02A45 | EXTENDED_ID, struct.pack("<HHHH", 32256, 31360, 0xFFFF, 0xFFFF))

FRAMES = {
    "reference": [
        (0x120, struct.pack("<hhhBB", -1500, 20, 9810, 7, 1), {A: 9.81, X: -1.5, Y: 0.02}),
        (0x121, struct.pack("<hhhBB", 10, -400, 30, 7, 1), {P: -2.0 * RAD, R: 0.05 * RAD, TURN: 0.15 * RAD}),
        (0x130, struct.pack("<HBB", 10_000, 12, 3), {V: 20.0}),
        (0x131, struct.pack("<ii", 455_000_000, -1_222_500_000), {LAT: 45.5, LON: -122.25}),
        (0x131, struct.pack("<ii", -(2**31), -(2**31)), {}),  # no fix
        (0x140, struct.pack("<IBBBB", 123_456_789, 0b0101, 0, 0, 0), {ODO: 123_456_789.0, ON: 1.0, DOOR: 1.0}),
        (0x140, struct.pack("<IBBBB", 5, 0b1111, 0, 0, 0), {ODO: 5.0}),
    ],
    "canmod_gps": [
        # z: (9.75 + 64) / 0.125 = 590; y: (-0.5 + 64) / 0.125 = 508
        # x rate: (-1.25 + 256) / 0.25 = 1019; y rate: (3.5 + 256) / 0.25 = 1038; z rate: (2 + 256) / 0.25 = 1032
        (
            0x009,
            bits((0, 1), (1, 512), (11, 508), (21, 590), (31, 1019), (42, 1038), (53, 1032)),
            {A: 9.75, Y: -0.5, P: 3.5 * RAD, R: -1.25 * RAD, TURN: 2.0 * RAD},
        ),
        (0x007, bits((0, 1), (1, 12_345), (21, 99), length=5), {V: 12.345}),
        # (45.5 + 90) x 1e6 and (-122.25 + 180) x 1e6
        (0x003, bits((0, 1), (1, 135_500_000), (29, 57_750_000)), {LAT: 45.5, LON: -122.25}),
        (0x003, bits((1, 135_500_000), (29, 57_750_000)), {}),
        (0x006, bits((0, 1), (1, 43_210), (42, 77)), {ODO: 43_210.0}),
    ],
    "j1939": [*(f for f in J1939_FRAMES), (*J1939_RATES, {P: 2.0 * RAD, R: -5.0 * RAD})],
    "j1939_aceinna": [(*J1939_RATES, {P: 5.0 * RAD, R: 2.0 * RAD})],
    "pcan_gps": [
        (0x600, struct.pack("<hhhh", 0, 0, 256, 0), {A: 256 * 3.91e-3 * 9.80665}),
        (0x610, struct.pack("<ff", 1.0, -2.5), {P: -2.5 * RAD, R: 1.0 * RAD}),
        (0x621, struct.pack("<ff", 123.0, 36.0), {V: 10.0}),
    ],
    "race_technology": [
        (0x094A6C21 | EXTENDED_ID, struct.pack("<hhhh", 0, 0, 0, 1000), {A: 9.80665}),
        (0x094A6D21 | EXTENDED_ID, struct.pack("<hhhh", 0, 70, -150, 25), {P: -1.5 * RAD, R: 0.25 * RAD}),
        (0x09567C22 | EXTENDED_ID, bits((16, 250_000)), {V: 25.0}),
    ],
    "xsens_mti": [
        (0x34, struct.pack(">hhh", 0, -128, 2511), {A: 2511 / 256, Y: -0.5}),
        (0x32, struct.pack(">hhh", 32, -64, 16), {P: -0.125, R: 0.0625, TURN: 0.03125}),
        # 8.24 and 9.23 bits, fixed point
        (0x71, struct.pack(">ii", round(45.5 * 2**24), round(-122.25 * 2**23)), {LAT: 45.5, LON: -122.25}),
    ],
}  # fmt: skip


def test_every_shipped_map_has_a_frame_worked_out():
    assert set(FRAMES) == set(shipped_maps())


@pytest.mark.parametrize("name", FRAMES)
def test_hand_computed_frames(name):
    signal_map = load_signal_map(f"springscale:{name}")
    assert signal_map.payload_width == CLASSIC_BYTES
    for can_id, payload, expected in FRAMES[name]:
        motion = Decoder(signal_map).decode(frames_of([(0, can_id, payload)]))
        found = {s: x for s, x in zip(motion.signals, motion.columns[0], strict=True) if math.isfinite(x)}
        wanted = {s: x for s, x in expected.items() if s in signal_map.signals}
        assert found == pytest.approx(wanted), f"{name} {can_id:X}"
