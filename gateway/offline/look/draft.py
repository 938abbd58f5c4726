"""A draft of a signal map from the findings, with the evidence for each, for a person to check."""

import json
import os
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from gateway.bus.signals import load_signal_map, shipped_map
from gateway.bus.signals.bit_field import Coding
from gateway.bus.signals.dbc import DatabaseSignal
from gateway.bus.signals.signal_map import shipped_databases
from gateway.errors import ConfigurationError, SpringscaleError
from gateway.files.whole import refusal_told, write_whole, written_whole
from gateway.offline.look.log_look import Described, Look
from gateway.offline.look.roles import FoundRole
from gateway.records import I64, Signal

MOSTLY: Final = 0.5  # more often than not
COUNTED: Final = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.ROLL_RATE)  # timed by the message counter
COUNTER_BITS: Final = range(2, 33)  # chosen: one bit is a toggle
FIX_3D: Final = 3  # usual code of a three-dimensional GNSS fix


def write_draft(seen: Look, output: Path) -> tuple[Path, ...]:
    """Write the map and, beside it, the shipped databases it needs; returns the paths, the map first.

    Raises ConfigurationError if a file exists or the disk fails, SpringscaleError if nothing was found.
    """
    shipped = seen.shipped
    if shipped is None and not any(found.role is Signal.VERTICAL_ACCELERATION for found in seen.found):
        whole = [f"springscale:{fit.name}" for fit in seen.fits if fit.is_whole]
        choice = f"{' and '.join(whole)} fit alike: take the one of your device" if whole else "; ".join(seen.lacking)
        raise SpringscaleError(f"{output} is not written: {choice}")
    if shipped is None:
        text = _own_text(seen, output)
    else:
        checks = "".join(f"# CHECK: {what}\n" for what in seen.to_mend)
        text = checks + shipped_map(shipped.name).read_text(encoding="utf-8")
    databases = [path for path in shipped_databases() if f'"{path.name}"' in text]
    new = [output, *(output.parent / path.name for path in databases)]
    taken = [path for path in new if path.exists()]
    if taken:
        raise ConfigurationError(f"{taken[0]}: is there already, and is not written over; name another --output")
    with refusal_told(output, ConfigurationError):
        for path in databases:
            with written_whole(output.parent / path.name) as file:
                file.write(path.read_bytes())
        write_whole(output, text)
    load_signal_map(output)
    return tuple(new)


def _own_text(seen: Look, output: Path) -> str:
    """The map of the findings."""
    roles = {found.role: found for found in seen.found}
    sources = dict.fromkeys(found.reading.described.message.source for found in seen.found)
    up = roles[Signal.VERTICAL_ACCELERATION].reading.described
    lines = [f"# A first signal map, drafted from {seen.log.name} by springscale look: look at what says CHECK."]
    lines += [
        f"# CHECK: is {name} the database of this device? Only identifiers and lengths say so."
        for name in seen.unsure_databases
    ]
    lines += [f"# Still lacking: {what}" for what in seen.lacking]
    lines.append(f"dbc = [{', '.join(_toml(_as_named(path, output)) for path in sources)}]")
    if len({one.channel for one in seen.heard}) > 1:
        lines.append(f"channel = {_toml(up.heard.channel or '')}")
    if any(found.reading.described.by_group for found in seen.found):
        lines.append("j1939 = true")
    for found in seen.found:
        rivals = [one for one in seen.described if one.is_rival(found.reading.described)]
        lines += ["", *_entry(found, rivals)]
    return "\n".join(lines) + "\n"


def _as_named(path: Path, output: Path) -> str:
    """A database's path relative to the map; shipped databases are copied beside it."""
    beside = path in shipped_databases() or path.resolve().parent == output.resolve().parent
    return path.name if beside else Path(os.path.relpath(path.resolve(), output.resolve().parent)).as_posix()


def _entry(found: FoundRole, rivals: Sequence[Described]) -> Iterator[str]:
    signal = found.reading.signal
    yield f"[signals.{found.role}] # {'' if found.is_sure else 'CHECK: '}{found.why}"
    yield f"message = {_toml(found.reading.described.message.name)}"
    yield f"signal = {_toml(signal.name)}"
    if rivals:
        others = ", ".join(f"{one.source_address:#04x}" for one in rivals)
        yield f"source_address = {found.reading.described.source_address:#04x} # CHECK: {others} send it too"
    if found.role in (Signal.SPEED, Signal.WHEEL_SPEED):
        yield "latency_s = 0.0 # CHECK: how late the receiver tells it; 0.2 is usual where it sends five times a second"
    else:
        yield f"sign = {found.sign}"
    if (condition := _valid_when(found.reading.described, signal)) is not None:
        yield f"valid_when = {{ {_toml(condition[0])} = {condition[1]} }}"
    if found.role in COUNTED and (counter := _counter(found.reading.described)) is not None:
        yield f"counter = {_toml(counter)}"


def _valid_when(described: Described, signal: DatabaseSignal) -> tuple[str, int] | None:
    """The only flag of the message that says "valid" and is mostly set, or a GNSS fix that is mostly complete."""
    others = [other for other in described.message.signals.values() if other is not signal]
    flags = [each for each in others if each.field.length == 1 and re.search(r"(?i)(?<!in)valid", each.name)]
    valid = [each.name for each in flags if float(np.mean(_raw(described, each) == 1)) > MOSTLY]
    if len(valid) == 1:
        return valid[0], 1
    fixes = {each.name: _raw(described, each) for each in others if each.name.lower().startswith("fix")}
    whole = [name for name, bits in fixes.items() if bits.max() == FIX_3D and np.mean(bits == FIX_3D) > MOSTLY]
    return (whole[0], FIX_3D) if whole else None


def _counter(described: Described) -> str | None:
    """The signal of the message that usually advances by one from frame to frame."""
    for signal in described.message.signals.values():
        is_number = signal.field.length in COUNTER_BITS and signal.field.coding is not Coding.FLOAT
        if is_number and re.search(r"(?i)count|alive|seq", signal.name):
            steps = np.diff(_raw(described, signal)) % (1 << signal.field.length)
            if len(steps) and float(np.mean(steps == 1)) > MOSTLY:
                return signal.name
    return None


def _raw(described: Described, signal: DatabaseSignal) -> I64:
    """Raw integers (n,) of one signal in the frames of the right length."""
    frames = described.heard.frames
    return signal.field.bits(frames.payload[frames.length == described.message.length]).astype(np.int64)


def _toml(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)  # a basic string of TOML
