"""Recorded drives: our numbers are python-can's and cantools' numbers, line by line."""

import gzip
import itertools

import can
import cantools
import numpy as np
import pytest
from support.recordings import recordings

from gateway.bus.logs import motion_of_log
from gateway.bus.signals import load_signal_map
from gateway.records import Signal
from gateway.units import si_factor

N_LINES = 20_000

DRIVES = {
    "real_drive": (
        "real_drive/candump_tripA.log.gz",
        "real_drive/canmod-gps.dbc",
        {
            Signal.VERTICAL_ACCELERATION: ("gnss_imu", "AccelerationX", 1, {"ImuValid": 1}),
            Signal.PITCH_RATE: ("gnss_imu", "AngularRateZ", -1, {"ImuValid": 1}),
            Signal.SPEED: ("gnss_speed", "Speed", 1, {"SpeedValid": 1}),
        },
        "can1",
    ),
    "known_loads": (
        "known_loads/05_L270_d0.50/can.log.gz",
        "known_loads/mjvan.dbc",
        {
            Signal.VERTICAL_ACCELERATION: ("IMU_ACCEL", "AccelZ", 1, {}),
            Signal.PITCH_RATE: ("IMU_GYRO", "PitchRate", 1, {}),
            Signal.SPEED: ("GPS_SPEED", "Speed", 1, {"Fix": 3}),
        },
        None,
    ),
}
QUANTITY = {
    Signal.VERTICAL_ACCELERATION: "acceleration",
    Signal.PITCH_RATE: "angular_rate",
    Signal.SPEED: "speed",
}


@pytest.fixture(params=DRIVES)
def drive(request, tmp_path):
    """(path of the log's first lines, database, what is mapped, channel, signal map)."""
    recorded = recordings()
    log, dbc, mapped, channel = DRIVES[request.param]
    with gzip.open(recorded / log, "rb") as packed:
        text = b"".join(itertools.islice(packed, 5_000, 5_000 + N_LINES))
    (tmp_path / "slice.log").write_bytes(text)
    database = cantools.database.load_file(recorded / dbc)
    return tmp_path / "slice.log", database, mapped, channel, load_signal_map((recorded / dbc).parent / "signals.toml")


def truth_of(path, database, mapped, channel):
    """Times and samples of each signal, one frame after the other."""
    found = {signal: ([], []) for signal in mapped}
    by_id = {database.get_message_by_name(message).frame_id: message for message, *_ in mapped.values()}
    for frame in can.CanutilsLogReader(path):
        if frame.arbitration_id not in by_id or frame.is_extended_id or channel not in (None, frame.channel):
            continue
        message = database.get_message_by_name(by_id[frame.arbitration_id])
        numbers = message.decode(frame.data, decode_choices=False)
        for signal, (name, dbc_signal, sign, conditions) in mapped.items():
            if name == message.name and all(numbers[c] == allowed for c, allowed in conditions.items()):
                unit = message.get_signal_by_name(dbc_signal).unit
                found[signal][0].append(round(frame.timestamp * 1e6) * 1000)
                found[signal][1].append(numbers[dbc_signal] * (sign * si_factor(QUANTITY[signal], unit)))
    return found


def test_every_sample_is_python_cans_and_cantools(drive):
    path, database, mapped, channel, signal_map = drive
    chunks, report = motion_of_log(path, signal_map)
    motions = list(chunks)
    truth = truth_of(path, database, mapped, channel)
    for signal in mapped:
        t_ns, samples = (np.concatenate(columns) for columns in zip(*(m.of(signal) for m in motions), strict=True))
        assert t_ns.tolist() == truth[signal][0]
        np.testing.assert_array_equal(samples, truth[signal][1])
    assert len(truth[Signal.VERTICAL_ACCELERATION][0]) > N_LINES / 3
    assert (report.lines, report.n_rejected) == (N_LINES, 0)
