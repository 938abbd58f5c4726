"""A silent sensor says why: its identifier is not there and what is instead, or its frames are refused and for what."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.bus_drive import bus_drive

from gateway.bus.logs import write_candump
from gateway.bus.signals import load_signal_map
from gateway.calibration.inspection.finding import Severity
from gateway.calibration.inspection.rows import rate_findings, row_facts
from gateway.core.settings import BatchSettings
from gateway.offline.campaigns import read_whole_log
from gateway.offline.look.look import why_silent
from gateway.records import EXTENDED_ID, Frames, Signal
from gateway.status import DecodeCount, SignalHealth, State, Status

REFERENCE = load_signal_map("springscale:reference")
GYRO = 0x121
Alter = Callable[[Frames], Frames]


def renumbered(to: int) -> Alter:
    def altered(frames: Frames) -> Frames:
        can_id = np.where(frames.can_id == GYRO, np.uint32(to), frames.can_id)
        return Frames(frames.t_ns, can_id, frames.length, frames.payload)

    return altered


def never_valid(frames: Frames) -> Frames:
    payload = frames.payload.copy()
    payload[frames.can_id == GYRO, 7] = 0
    return Frames(frames.t_ns, frames.can_id, frames.length, payload)


def cut_short(frames: Frames) -> Frames:
    length = np.where(frames.can_id == GYRO, np.uint8(7), frames.length)
    return Frames(frames.t_ns, frames.can_id, length, frames.payload)


@pytest.mark.parametrize(
    ("alter", "words"),
    [
        (renumbered(0x125), "nothing of IMU_GYRO (121) came; similar: 125 on can0, 100 times a second, 8 bytes"),
        (
            renumbered(0x121 | EXTENDED_ID),
            "nothing of IMU_GYRO (121) came; similar: 00000121 on can0, 100 times a second, 8 bytes",
        ),
        (renumbered(0x700), "nothing of IMU_GYRO (121) came; and no identifier like it"),
        (never_valid, "2000 frames of IMU_GYRO (121) came, none valid: 2000 invalid"),
        (cut_short, "2000 frames of IMU_GYRO (121) came, none valid: 2000 wrong length"),
    ],
)
def test_a_silent_sensor_says_why(alter: Alter, words: str, tmp_path: Path) -> None:
    log = tmp_path / "drive.log"
    write_candump(alter(bus_drive(20.0, seed=3)), "can0", log)
    silent = (Signal.PITCH_RATE, Signal.ROLL_RATE)  # both come in one message
    why = {signal: why_silent(log, REFERENCE, signal) for signal in silent}
    assert why == dict.fromkeys(silent, words)
    facts = row_facts(read_whole_log(log, REFERENCE)[0], REFERENCE.traits)
    pitch, roll = rate_findings(facts, BatchSettings(), why)
    assert pitch.text == f"pitch_rate has 0 samples in the whole run: {words}"
    assert (pitch.severity, roll.severity) == (Severity.FAULT, Severity.WARNING)
    assert roll.text == f"roll_rate has 0 samples in the whole run: {words}"


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        ({"ok": 0}, "Silent: pitch rate (no frame of its message)."),
        ({"ok": 0, "invalid": 900}, "Silent: pitch rate (900 frames came, all invalid)."),
        ({"ok": 900}, "Silent: pitch rate."),
    ],
)
def test_the_service_says_it_too(counts: dict[str, int], words: str) -> None:
    status = Status(
        version="1",
        state=State.SENSOR_FAULT,
        uptime_s=90.0,
        calibration_id="sha256:ab",
        signals=(SignalHealth(signal="pitch_rate", last_age_s=None),),
        decode=tuple(DecodeCount(signal="pitch_rate", reason=reason, n=n) for reason, n in counts.items()),
    )
    assert words in status.state_in_words
