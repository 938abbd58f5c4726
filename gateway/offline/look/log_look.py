"""Looks at a log: the shipped maps that fit it, the roles of its signals, what is lacking, and a draft of a map."""

import json
import math
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from gateway.bus.frames import merge_frames
from gateway.bus.signals import SHIPPED_PREFIX, Decoder, load_signal_map, shipped_map
from gateway.bus.signals.bit_field import Coding
from gateway.bus.signals.dbc import DatabaseMessage, Databases
from gateway.bus.signals.decode import SAME_SPEED_SHARE, TELLING_SHARE, Remark
from gateway.bus.signals.mapping import QUANTITIES, SOURCE_ADDRESS, id_name
from gateway.bus.signals.signal_map import FEWEST_COUNTER_BITS, MOST_COUNTER_BITS, shipped_databases, shipped_maps
from gateway.core.batch import GRAVITY_TOLERANCE_MPS2, RATE_MIN_SHARE
from gateway.core.batch_settings import BatchSettings
from gateway.errors import ConfigurationError, SignalMapError, SpringscaleError
from gateway.files.whole import refusal_told, write_whole, written_whole
from gateway.offline.look.heard import Heard, SignalReading, heard_in, readings_of, with_message
from gateway.offline.look.roles import FoundRole, beside, roles_of
from gateway.records import ASIDE, Signal
from gateway.units import STANDARD_GRAVITY_MPS2, TO_SI

LEAST_RATE_HZ: Final = RATE_MIN_SHARE * BatchSettings().rate_hz
MOST_TILT_DEG: Final = 15.0  # chosen: 3 % of gravity; beyond it the horizontal axes mix in noticeably
MOSTLY: Final = 0.5  # more often than not
COUNTED: Final = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.ROLL_RATE)  # timed by the message counter
FIX_3D: Final = 3  # usual code of a three-dimensional GNSS fix


@dataclass(frozen=True, slots=True)
class MapFit:
    """A shipped map on one channel: the signals found and missing, the median of its vertical axis, which frames do
    not fit it, and the needed signals whose frames are all left out. It fits if both inertial signals come, and gravity
    is on the mapped axis.
    """

    name: str
    channel: str | None
    found: list[Signal]
    missing: list[Signal]
    vertical_mps2: float | None
    causes: list[str]
    silent: list[Remark]

    @property
    def has_gravity(self) -> bool:
        """Whether gravity is on the mapped vertical axis."""
        return abs((self.vertical_mps2 or 0.0) - STANDARD_GRAVITY_MPS2) < GRAVITY_TOLERANCE_MPS2

    @property
    def fits(self) -> bool:
        return self.has_gravity and {Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE} <= {*self.found}


def fits_of(heard: Sequence[Heard]) -> list[MapFit]:
    """The shipped maps with at least one signal found, the best first."""
    fits = []
    for name in (f"{SHIPPED_PREFIX}{name}" for name in shipped_maps()):
        signal_map = load_signal_map(name)
        for channel in sorted({one.channel for one in heard}, key=str):
            on_it = [one for one in heard if one.channel == channel]
            ours = [one.frames for one in on_it if any(ids.is_for(one.can_id) for ids in signal_map.filters)]
            decoder = Decoder(signal_map)
            motion = decoder.decode(merge_frames(ours))
            found = [signal for signal in motion.signals if len(motion.of(signal)[1])]
            missing = [signal for signal in motion.signals if signal not in found and signal not in ASIDE]
            vertical = motion.of(Signal.VERTICAL_ACCELERATION)[1]
            vertical_mps2 = round(float(np.median(vertical)), 3) if len(vertical) else None
            causes, silent = decoder.causes(), [each for each in decoder.silent() if each.share]
            fits.append(MapFit(name, channel, found, missing, vertical_mps2, [one.text for one in causes], silent))
    return sorted((fit for fit in fits if fit.found), key=lambda fit: (not fit.fits, len(fit.missing), fit.name))


class Look:
    """The findings about a log.

    ``refused`` are frames and values that the databases do not allow, ``to_mend`` what a signal map must say or a
    person must check, ``lacking`` the obstacles: none if the log suffices.
    """

    def __init__(self, log: Path, databases: Sequence[Path] = ()) -> None:
        """Inspect a log with these databases (default: those beside it or in the parent folder) and the shipped ones.

        Raises LogUnreadableError if there is no frame in it, SignalMapError for a given database that cannot be read.
        """
        self.log, folder = log, log.resolve().parent
        heard, self.report = heard_in(log)
        # campaigns have a folder per drive
        self._own = list(databases) or sorted(folder.glob("*.dbc")) or sorted(folder.parent.glob("*.dbc"))
        messages: list[DatabaseMessage] = []
        self.faults: list[str] = []
        for path in (*self._own, *shipped_databases()):
            try:
                sound, unsound = Databases(path, [path]).sound()
            except SignalMapError as fault:
                if path in databases:
                    raise
                sound, unsound = [], [str(fault)]
            messages += sound
            self.faults += unsound
        self.heard = [with_message(one, messages, self._own) for one in heard]
        origin_ns = min(int(one.frames.t_ns.min()) for one in heard)
        known = [(one, one.message) for one in self.heard if one.message]
        self.readings = [reading for one, message in known for reading in readings_of(one, message, origin_ns)]
        able = [each for each in self.readings if len(each.x)]
        self.found = roles_of([each for each in able if each.message.source in self._own] or able)
        self.fits = fits_of(heard)
        self.whole = [fit for fit in self.fits if fit.fits]
        used = {*self._own, *(each.reading.message.source for each in self.found)}
        self._remarks = [
            each for reading in self.readings if reading.message.source in used for each in reading.remarks
        ]
        self.refused = list(dict.fromkeys(remark.text for remark in self._remarks))
        self.to_mend = list(dict.fromkeys(self._to_mend()))
        up = next((each for each in self.found if each.role is Signal.VERTICAL_ACCELERATION), None)
        across_mps2 = math.hypot(*(each.usual for each in beside(able, up))) if up else 0.0
        self.tilt_deg = round(math.degrees(math.atan2(across_mps2, abs(up.reading.usual))), 1) if up else None
        self.lacking = list(self._lacking())

    def to_json(self) -> dict[str, Any]:
        """The findings for programs; numbers in SI."""
        identifiers = [
            {
                "channel": one.channel,
                "id": id_name(one.can_id),
                "n_frames": one.n_frames,
                "rate_hz": round(one.rate_hz, 2),
                "lengths": one.lengths,
                "message": one.message and one.message.name,
                "database": one.message and one.message.source.name,
            }
            for one in self.heard
        ]
        return {
            "identifiers": identifiers,
            "signals": {each.role: _part(each, "name", "sign", "is_sure", "why") for each in self.found},
            "left_out": self.report.left_out,
            "maps": [_part(fit, "name", "channel", "fits", "missing", "vertical_mps2") for fit in self.fits],
            "can_work": not self.lacking,
            **_part(self, "tilt_deg", "refused", "to_mend", "lacking"),
        }

    def _to_mend(self) -> Iterator[str]:
        """What suits no map as it is. J1939 devices that send the same speed are no matter."""
        speeds = [each for each in self.found if each.reading.quantity == "speed" and not each.is_sure]
        yield from (f"{each.name} reads {each.why}" for each in speeds)
        if self.whole:
            yield from (cause for fit in self.whole for cause in fit.causes)
            return
        for path in dict.fromkeys(each.reading.message.source for each in self.found):
            if path in shipped_databases():
                yield f"is {path.name} the database of this device? Only identifiers and lengths say so"
        for ours in (each.reading for each in self.found):
            same = [each for each in self.readings if each.is_rival(ours) and len(each.x)]
            if ours.quantity == "speed":
                same = [each for each in same if not np.isclose(each.x.mean(), ours.x.mean(), SAME_SPEED_SHARE, 0.0)]
            if same:
                devices = " and ".join(f"{_address(one)} ({len(one.x):,} samples)" for one in (ours, *same))
                yield f"{ours.name} comes from {devices}: state the source_address of one"

    def _lacking(self) -> Iterator[str]:
        """The obstacles to weighing with this log, and their remedies."""
        remarks = (*self._remarks, *(each for fit in self.whole for each in fit.silent))
        lost = {signal for each in remarks if each.share >= TELLING_SHARE for signal in each.signals}
        roles = {each.role: each for each in self.found}
        up, pitch = roles.get(Signal.VERTICAL_ACCELERATION), roles.get(Signal.PITCH_RATE)
        has_speed = {Signal.SPEED, Signal.WHEEL_SPEED} & {*(self.whole[0].found if self.whole else roles)}
        described = {each.quantity for each in self.readings}
        for is_missing, signal, what, remedy in (
            (not self.whole and up is None, Signal.VERTICAL_ACCELERATION, "acceleration reads 9.8 m/s2",
             "the sensor is not in this log, or takes gravity off"),
            (not self.whole and up is not None and pitch is None, Signal.PITCH_RATE, "pitch rate could be told",
             "drive with some braking, or name it yourself"),
            (not has_speed, Signal.SPEED, "speed", "add [signals.speed] from a GNSS receiver or the vehicle"),
        ):  # fmt: skip
            quantity = QUANTITIES[signal]
            if is_missing and signal in lost:
                yield f"no {what}: frames or values that would show it are refused, as told above"
            elif is_missing and quantity not in described and quantity != "speed":
                units = ", ".join(TO_SI[quantity])
                yield f"no {what}: no database describes one in {units}: give that of the sensor by --dbc"
            elif is_missing:
                yield f"no {what}: {remedy}"
        if not self.whole and (self.tilt_deg or 0.0) > MOST_TILT_DEG:
            yield f"the sensor leans by {self.tilt_deg:.0f} degrees: mount it level, or have it turn its axes"
        for each in (up, pitch):
            if each is not None and (rate_hz := each.reading.rate_hz) < LEAST_RATE_HZ:
                yield f"{each.name} comes {rate_hz:.3g} times a second; {LEAST_RATE_HZ:.0f} are needed"

    def write_draft(self, output: Path) -> list[Path]:
        """Write a map and, beside it, the shipped databases it needs; returns the paths, the map first.

        Raises ConfigurationError if a file exists or the disk fails, SpringscaleError if nothing was found.
        """
        text = "".join(f"# CHECK: {what}\n" for what in self.to_mend)
        if len(self.whole) == 1:
            text += shipped_map(self.whole[0].name.removeprefix(SHIPPED_PREFIX)).read_text(encoding="utf-8")
        elif any(each.role is Signal.VERTICAL_ACCELERATION for each in self.found):
            text += "\n".join(self._draft(output.resolve().parent)) + "\n"
        else:
            alike = f"{' and '.join(fit.name for fit in self.whole)} fit alike: take the one of your device"
            raise SpringscaleError(f"{output} is not written: {alike if self.whole else '; '.join(self.lacking)}")
        databases = [path for path in shipped_databases() if f'"{path.name}"' in text]
        new = [output, *(output.parent / path.name for path in databases)]
        if taken := [path for path in new if path.exists()]:
            raise ConfigurationError(f"{taken[0]}: is there already, and is not written over; name another --output")
        with refusal_told(output, ConfigurationError):
            for path in databases:
                with written_whole(output.parent / path.name) as file:
                    file.write(path.read_bytes())
            write_whole(output, text)
        load_signal_map(output)
        return new

    def _draft(self, folder: Path) -> Iterator[str]:
        """The lines of a map of the findings. Shipped databases are copied beside it, others named relative to it."""
        yield f"# A first signal map, drafted from {self.log.name} by springscale look: look at what says CHECK."
        yield from (f"# Still lacking: {what}" for what in self.lacking)
        sources, shipped = dict.fromkeys(each.reading.message.source for each in self.found), shipped_databases()
        paths = [each.name if each in shipped else os.path.relpath(each.resolve(), folder) for each in sources]
        yield f"dbc = {_toml(paths)}"
        if len({one.channel for one in self.heard}) > 1:
            up = next(each for each in self.found if each.role is Signal.VERTICAL_ACCELERATION)
            yield f"channel = {_toml(up.reading.heard.channel)}"
        if any(each.reading.heard.by_group for each in self.found):
            yield "j1939 = true"
        for each in self.found:
            yield ""
            yield from _entry(each, [one for one in self.readings if one.is_rival(each.reading)])


def _entry(found: FoundRole, rivals: list[SignalReading]) -> Iterator[str]:
    """The lines of one signal: its conditions and its counter are the signals beside it that behave so."""
    ours = found.reading
    yield f"[signals.{found.role}] # {'' if found.is_sure else 'CHECK: '}{found.why}"
    yield f"message = {_toml(ours.message.name)}"
    yield f"signal = {_toml(ours.signal.name)}"
    if rivals:
        yield f"source_address = {_address(ours)} # CHECK: {', '.join(map(_address, rivals))} send it too"
    lateness = "0.0 # CHECK: how late the receiver tells it; 0.2 is usual where it sends five times a second"
    yield f"latency_s = {lateness}" if ours.quantity == "speed" else f"sign = {found.sign}"
    payload = ours.heard.frames.payload[ours.heard.frames.length == ours.message.length]
    raw = {
        name: (each.field.length, each.field.bits(payload).astype(np.int64))
        for name, each in ours.message.signals.items()
        if each is not ours.signal and each.multiplexer is None and each.field.coding is not Coding.FLOAT
        and each.field.n_bytes <= ours.message.length
    }  # fmt: skip
    is_flag = re.compile(r"(?i)(?<!in)valid")
    valid = [name for name, (n, bits) in raw.items() if n == 1 and is_flag.search(name) and np.mean(bits) > MOSTLY]
    fixes = [name for name, (_, bits) in raw.items() if name.lower().startswith("fix") and bits.max() == FIX_3D]
    whole = [name for name in fixes if np.mean(raw[name][1] == FIX_3D) > MOSTLY]
    if condition := (f"{_toml(valid[0])} = 1" if len(valid) == 1 else f"{_toml(whole[0])} = {FIX_3D}" if whole else ""):
        yield f"valid_when = {{ {condition} }}"
    counters = [
        name for name, (n, bits) in raw.items()
        if FEWEST_COUNTER_BITS <= n <= MOST_COUNTER_BITS and re.search(r"(?i)count|alive|seq", name)
        and np.count_nonzero(np.diff(bits) % (1 << n) == 1) > MOSTLY * (len(bits) - 1)
    ]  # fmt: skip
    if found.role in COUNTED and counters:
        yield f"counter = {_toml(counters[0])}"


def _address(reading: SignalReading) -> str:
    return f"{reading.heard.can_id & SOURCE_ADDRESS:#04x}"


def _part(one: object, *names: str) -> dict[str, Any]:
    return {name: getattr(one, name) for name in names}


def _toml(told: str | list[str] | None) -> str:
    return json.dumps(told, ensure_ascii=False)  # a basic string of TOML, or a list of them
