"""Several J1939 devices that send the same group: told with their addresses, and one of them can be chosen."""

import re
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from support.bus_drive import bus_drive
from support.commands import called

from gateway.bus.frames import merge_frames
from gateway.bus.logs import write_candump
from gateway.bus.logs.open import open_log
from gateway.bus.signals import Decoder, load_signal_map, shipped_map
from gateway.errors import LogUnreadableError, SignalMapError
from gateway.records import EXTENDED_ID, Frames, Signal

J1939: Final = shipped_map("j1939")
GROUPS: Final = {Signal.VERTICAL_ACCELERATION: 0xF02D, Signal.PITCH_RATE: 0xF02A, Signal.SPEED: 0xFEE8}
FIRST, SECOND = 0x21, 0x80
ALIKE, OTHERWISE, UNAVAILABLE = "the same", "another", "not available"


def group_of(frames: Frames) -> np.ndarray:
    return frames.can_id >> np.uint32(8) & np.uint32(0xFFFF)


def sent_by(frames: Frames, address: int) -> Frames:
    can_id = frames.can_id & np.uint32(0xFFFF_FF00) | np.uint32(address)
    return Frames(frames.t_ns, can_id, frames.length, frames.payload)


def two_devices(signal: Signal, says: str, n_left_out: int = 0) -> Frames:
    """A drive of one device, and what a second one says of one group a millisecond later."""
    drive = sent_by(bus_drive(100.0, seed=3, signals="springscale:j1939"), FIRST)
    chosen = np.flatnonzero(group_of(drive) == GROUPS[signal])[n_left_out:]
    payload = drive.payload[chosen].copy()
    if says != ALIKE:
        payload[:] = {OTHERWISE: 0x00, UNAVAILABLE: 0xFF}[says]
    t_ns, can_id, length = drive.t_ns[chosen] + 1_000_000, drive.can_id[chosen], drive.length[chosen]
    return merge_frames([drive, sent_by(Frames(t_ns, can_id, length, payload), SECOND)])


def decoded(frames: Frames, signal_map: Path = J1939) -> Decoder:
    decoder = Decoder(load_signal_map(signal_map))
    decoder.decode(frames)
    return decoder


@pytest.mark.parametrize("signal", GROUPS)
@pytest.mark.parametrize("says", [ALIKE, OTHERWISE, UNAVAILABLE])
def test_a_group_of_two_devices_is_reported_with_both_addresses(signal: Signal, says: str) -> None:
    causes = decoded(two_devices(signal, says, n_left_out=3)).causes()
    if says == UNAVAILABLE or (says == ALIKE and signal is Signal.SPEED):  # nothing is mixed, or nothing that differs
        assert causes == ()
        return
    (cause,) = causes
    assert signal in cause.signals
    n = {Signal.SPEED: 500}.get(signal, 10_000)
    assert f"0x21 ({n:,}), 0x80 ({n - 3:,})" in cause.text
    assert "source_address" in cause.text
    assert cause.share == pytest.approx(0.5, abs=0.01)


def chosen_map(folder: Path, **addresses: int) -> Path:
    """The shipped map, beside its database, with addresses for some signals."""
    text = J1939.read_text()
    for signal, address in addresses.items():
        text, n = re.subn(rf"(\[signals\.{signal}\].*)", rf"\1\nsource_address = {address:#04x}", text)
        assert n == 1
    (folder / "j1939.dbc").write_bytes(J1939.with_name("j1939.dbc").read_bytes())
    (folder / "signals.toml").write_text(text)
    return folder / "signals.toml"


@pytest.mark.parametrize(("address", "speed_mps"), [(FIRST, 13.9), (SECOND, 0.0)])
def test_the_chosen_device_alone_counts(address: int, speed_mps: float, tmp_path: Path) -> None:
    signal_map = load_signal_map(chosen_map(tmp_path, speed=address))
    decoder = Decoder(signal_map)
    speeds = decoder.decode(two_devices(Signal.SPEED, OTHERWISE)).of(Signal.SPEED)[1]
    assert len(speeds) == 500
    assert np.median(speeds) == pytest.approx(speed_mps, abs=0.1)
    assert decoder.causes() == ()
    assert [ids.is_for(0x18FEE800 | EXTENDED_ID | address) for ids in signal_map.filters].count(True) == 1


def test_two_signals_of_one_group_may_come_from_two_devices(tmp_path: Path) -> None:
    path = chosen_map(tmp_path, speed=FIRST, wheel_speed=SECOND)
    path.write_text(path.read_text().replace("CCVS1", "VDS").replace("WheelBased", "NavigationBased"))
    motion = Decoder(load_signal_map(path)).decode(two_devices(Signal.SPEED, OTHERWISE))
    assert np.median(motion.of(Signal.SPEED)[1]) == pytest.approx(13.9, abs=0.1)
    assert np.median(motion.of(Signal.WHEEL_SPEED)[1]) == 0.0


REFUSED = {
    "no J1939 map": ("j1939 = true", "j1939 = false", "only messages with 29-bit identifiers have one, and with j1939"),
    "the null address": ("source_address = 0x21", "source_address = 254", "254 is above 253"),
    "a text": ("source_address = 0x21", 'source_address = "0x21"', "source_address"),
    "half of a group chosen": (
        'message = "CCVS1"\nsignal = "WheelBasedVehicleSpeed"',
        'message = "VDS"\nsignal = "NavigationBasedVehicleSpeed"',
        "each or none with a source_address",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_an_address_that_means_nothing_is_refused(kind: str, tmp_path: Path) -> None:
    old, new, said = REFUSED[kind]
    path = chosen_map(tmp_path, speed=FIRST)
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(SignalMapError, match=said):
        load_signal_map(path)


NEARLY = {  # the first line of the map, its source address, the identifier in the log, and what is said of it
    "another address": ("j1939 = true", "source_address = 0x33", "18FF2021", "from the J1939 source address 0x21"),
    "no J1939": ("", "", "18FF2021", "correct source_address, or set j1939 = true"),
    "11 bits": ("", "", "120", "120 has the number of 00000120 in 11 bits: correct the database"),
}


@pytest.mark.parametrize("kind", NEARLY)
@pytest.mark.parametrize("suffix", [".log", ".asc"])
def test_identifiers_that_are_nearly_those_of_the_map_are_named(kind: str, suffix: str, tmp_path: Path) -> None:
    """Not the vehicle: it is the right one."""
    head, more, can_id, said = NEARLY[kind]
    mapped = (0x120 if kind == "11 bits" else 0x18FF20FE) | 1 << 31
    (tmp_path / "a.dbc").write_text(
        f'VERSION ""\nNS_ :\nBS_:\nBU_: A\nBO_ {mapped} IMU: 8 A\n SG_ Z : 0|16@1- (0.001,0) [0|0] "m/s^2" A\n'
    )
    entry = f'[signals.vertical_acceleration]\nmessage = "IMU"\nsignal = "Z"\n{more}\n'
    (tmp_path / "a.toml").write_text(f'{head}\ndbc = ["a.dbc"]\n{entry}')
    extended = "x" if len(can_id) > 3 else ""
    lines = {
        ".log": f"(1790000000.5) can0 {can_id}#0011223344556677\n",
        ".asc": f"date 2026-11-01T00:00:00Z\n0.5 1 {can_id}{extended} Rx d 8 00 11 22 33 44 55 66 77\n",
    }
    log = tmp_path / f"a{suffix}"
    log.write_text(lines[suffix])
    chunks, report = open_log(log, load_signal_map(tmp_path / "a.toml"))
    assert list(chunks) == []
    with pytest.raises(LogUnreadableError, match=said) as refusal:
        report.require_frames()
    assert "map of this vehicle" not in str(refusal.value)


@pytest.mark.parametrize("signal", GROUPS)
def test_look_and_estimate_name_both_devices(signal: Signal, tmp_path: Path) -> None:
    write_candump(two_devices(signal, OTHERWISE), "can0", tmp_path / "drive.log")
    said = called("look", tmp_path / "drive.log")
    verdict = said.stdout.partition("\nThis can")[2]
    assert verdict.startswith((" work, once the signal map says so", "not work yet"))
    assert "0x21 (" in verdict
    assert "0x80 (" in verdict
    assert "state the source_address of one" in verdict
    told = called("estimate", tmp_path / "drive.log", "--signals", "springscale:j1939").stderr
    assert f"2 devices send {signal}" in told


def test_a_draft_of_ones_own_database_chooses_one_device(tmp_path: Path) -> None:
    database = J1939.with_name("j1939.dbc").read_text()
    for old, new in (("ACCS", "BOX"), ("AngularRate1", "PitchRate")):
        database = database.replace(old, new)
    (tmp_path / "box.dbc").write_text(database.replace("[-320|322.55]", "[-40|40]"))
    frames = two_devices(Signal.PITCH_RATE, OTHERWISE)
    write_candump(frames, "can0", tmp_path / "drive.log")
    output = tmp_path / "signals.toml"
    assert called("look", tmp_path / "drive.log", "--output", output).exit_code == 0
    assert "source_address = 0x21 # CHECK: 0x80 send it too" in output.read_text()
    assert decoded(frames, output).causes() == ()
