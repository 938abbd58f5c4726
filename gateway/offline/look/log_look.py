"""Inspects a log: its identifiers, their signals by the databases, the shipped maps that fit, and what is lacking."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np

from gateway.bus.frames import join, merge_frames, take, widened
from gateway.bus.logs import LogReport, open_whole_log
from gateway.bus.signals import Decoder, load_signal_map
from gateway.bus.signals.bit_field import Coding
from gateway.bus.signals.dbc import DatabaseMessage, Databases, DatabaseSignal
from gateway.bus.signals.decode import (
    RANGE_TOLERANCE_STEPS,
    SAME_SPEED_SHARE,
    TELLING_SHARE,
    is_j1939_code,
    told_lengths,
    told_range,
    told_share,
)
from gateway.bus.signals.mapping import CAN_FD_BYTES, CLASSIC_BYTES, SOURCE_ADDRESS, id_name, j1939_filter
from gateway.bus.signals.signal_map import shipped_databases, shipped_maps
from gateway.core.batch import GRAVITY_TOLERANCE_MPS2, RATE_MIN_SHARE
from gateway.core.batch_settings import BatchSettings
from gateway.errors import SignalMapError
from gateway.offline.look.roles import FoundRole, roles_of, tilt_deg
from gateway.records import ASIDE, EXTENDED_ID, F64, Frames, Signal
from gateway.units import NS_PER_S, STANDARD_GRAVITY_MPS2, TO_SI

KEPT_FRAMES: Final = 100_000  # chosen: of one identifier: a quarter of an hour at 100 Hz; counts cover all frames
KEPT_BYTES: Final = 100_000_000  # chosen: of all frames kept; beyond it an identifier gets its first few
FIRST_FRAMES: Final = 200  # chosen: the few
MOST_IDENTIFIERS: Final = 4096  # chosen: of one channel; a bus has some hundreds
LEAST_RATE_HZ: Final = RATE_MIN_SHARE * BatchSettings().rate_hz
MOST_TILT_DEG: Final = 15.0  # chosen: 3 % of gravity; beyond it the horizontal axes mix in noticeably
QUANTITIES: Final = ("acceleration", "angular_rate", "speed")


@dataclass(frozen=True)
class Heard:
    """One identifier of one channel: the number of its frames, their time span, and the first of them."""

    channel: str | None
    can_id: int
    n_frames: int
    duration_s: float
    kept: Frames

    @property
    def frames(self) -> Frames:
        """The kept frames with payload rows of all their possible bytes."""
        return widened(self.kept, CAN_FD_BYTES)

    @property
    def rate_hz(self) -> float:
        """Frames a second, from the first to the last."""
        return (self.n_frames - 1) / self.duration_s if self.duration_s > 0.0 else 0.0

    @cached_property
    def lengths(self) -> dict[int, int]:
        """How many of the kept frames have which length, the most frequent first."""
        lengths, n_times = np.unique(self.kept.length, return_counts=True)
        order = np.argsort(-n_times, kind="stable")
        return dict(zip(lengths[order].tolist(), n_times[order].tolist(), strict=True))

    @property
    def name(self) -> str:
        """The identifier as candump writes it: three digits, or eight if it has 29 bits."""
        return id_name(self.can_id)


def heard_in(log: Path) -> tuple[tuple[Heard, ...], LogReport]:
    """Every identifier in order of channel and number. Raises LogUnreadableError if nothing can be read."""
    chunks, report = open_whole_log(log)
    of_all, n_others = _heard_of(chunks, None)
    report.require_frames()
    if n_others:
        report.notes.append(
            f"{n_others} frames are under further identifiers than the first {MOST_IDENTIFIERS}, which no bus has; "
            "they are left out here"
        )
    channels = sorted(report.channels)
    if len(channels) < 2:
        return tuple(replace(one, channel=next(iter(channels), None)) for one in of_all), report
    return tuple(one for each in channels for one in _heard_of(open_whole_log(log, each)[0], each)[0]), report


def _heard_of(chunks: Iterable[Frames], channel: str | None) -> tuple[list[Heard], int]:
    """The identifiers of the frames, all of one channel, ordered by identifier, and the number of frames of those that
    come when there are MOST_IDENTIFIERS.
    """
    spans: dict[int, tuple[int, int, int]] = {}  # number of frames, first and last stamp
    kept: dict[int, list[Frames]] = {}
    n_others = n_bytes = 0
    for chunk in chunks:
        order = np.argsort(chunk.can_id, kind="stable")
        can_ids, begins = np.unique(chunk.can_id[order], return_index=True)
        for can_id, begin, end in zip(can_ids.tolist(), begins.tolist(), [*begins[1:].tolist(), None], strict=True):
            rows = order[begin:end]
            if can_id not in spans and len(spans) >= MOST_IDENTIFIERS:
                n_others += len(rows)
                continue
            t_ns = chunk.t_ns[rows]
            first_ns, last_ns = int(t_ns.min()), int(t_ns.max())
            n, before_ns, after_ns = spans.get(can_id, (0, first_ns, last_ns))
            spans[can_id] = n + len(rows), min(first_ns, before_ns), max(last_ns, after_ns)
            if (room := (KEPT_FRAMES if n_bytes < KEPT_BYTES else FIRST_FRAMES) - n) > 0:
                ours = _narrowed(take(chunk, rows[:room]))
                kept.setdefault(can_id, []).append(ours)
                n_bytes += sum(column.nbytes for column in (ours.t_ns, ours.can_id, ours.length, ours.payload))
    return [
        Heard(channel, can_id, n, (last_ns - first_ns) / NS_PER_S, _joined(kept[can_id]))
        for can_id, (n, first_ns, last_ns) in sorted(spans.items())
    ], n_others


def _narrowed(frames: Frames) -> Frames:
    """Frames, at least one, with payload rows of 8 bytes where these hold all of them."""
    if int(frames.length.max()) > CLASSIC_BYTES:
        return frames
    return replace(frames, payload=frames.payload[:, :CLASSIC_BYTES].copy())


def _joined(parts: list[Frames]) -> Frames:
    width = max(part.payload.shape[1] for part in parts)
    return join([widened(part, width) for part in parts], width)


@dataclass(frozen=True, slots=True)
class Described:
    """An identifier and its message by a database; ``by_group`` if only the J1939 group is the same."""

    heard: Heard
    message: DatabaseMessage
    by_group: bool

    @property
    def source_address(self) -> int:
        return self.heard.can_id & SOURCE_ADDRESS

    def is_rival(self, other: "Described") -> bool:
        """Whether another device sends the same J1939 group on the same channel."""
        is_same = self.message is other.message and self.heard.channel == other.heard.channel
        return is_same and self.source_address != other.source_address

    @property
    def has_length(self) -> bool:
        """Whether frames have the length in the database."""
        return self.message.length in self.heard.lengths


@dataclass(frozen=True)
class SignalReading:
    """One signal of one identifier: times (n,) from the log's origin, valid samples (n,) and those out of range, in
    SI.
    """

    described: Described
    signal: DatabaseSignal
    quantity: str
    t_s: F64
    x: F64
    beyond: F64

    @property
    def name(self) -> str:
        """MESSAGE.SIGNAL."""
        return f"{self.described.message.name}.{self.signal.name}"

    @property
    def rate_hz(self) -> float:
        return self.described.heard.rate_hz

    @property
    def driving_rate_hz(self) -> float:
        """Frames a second as they usually follow each other, if that is more: a log may have long pauses."""
        step_s = float(np.median(np.diff(self.t_s))) if len(self.t_s) > 1 else 0.0
        return max(self.rate_hz, 1.0 / step_s) if step_s > 0.0 else self.rate_hz

    @cached_property
    def usual(self) -> float:
        """The median, SI; NaN without a sample."""
        return float(np.median(self.x)) if len(self.x) else float("nan")


def described(heard: Sequence[Heard], messages: Sequence[DatabaseMessage]) -> tuple[Described, ...]:
    """The identifiers with a message: first a message of their length, then the first of all."""
    found = []
    for one in heard:
        same = [Described(one, message, False) for message in messages if message.frame_id == one.can_id]
        groups = [m for m in messages if m.frame_id & one.can_id & EXTENDED_ID]
        same += [Described(one, m, True) for m in groups if j1939_filter(m.frame_id).is_for(one.can_id)]
        if same:
            found.append(min(same, key=lambda each: (not each.has_length, each.by_group)))
    return tuple(found)


def readings_of(found: Described, origin_ns: int) -> Iterator[SignalReading]:
    """The signals with a known unit, from frames of the right length."""
    frames = take(found.heard.frames, found.heard.frames.length == found.message.length)
    for signal in found.message.signals.values():
        quantity = _quantity_of(signal)
        if quantity is None or signal.multiplexer is not None or signal.field.n_bytes > found.message.length:
            continue
        bits = signal.field.bits(frames.payload)
        x = signal.field.physical(bits)
        is_valid = np.isfinite(x)
        if found.by_group and signal.field.coding is Coding.UNSIGNED:
            is_valid &= ~is_j1939_code(signal.field, bits)
        (low, high), slack = signal.limits, RANGE_TOLERANCE_STEPS * abs(signal.field.scale)
        is_beyond = is_valid & ((x < low - slack) | (x > high + slack))
        is_valid &= ~is_beyond
        x = x * TO_SI[quantity][_unit_of(signal)]
        t_s = (frames.t_ns[is_valid] - origin_ns) / NS_PER_S
        yield SignalReading(found, signal, quantity, t_s, x[is_valid], x[is_beyond])


def _unit_of(signal: DatabaseSignal) -> str:
    return (signal.unit or "").strip().lower()


def _quantity_of(signal: DatabaseSignal) -> str | None:
    return next((quantity for quantity in QUANTITIES if _unit_of(signal) in TO_SI[quantity]), None)


@dataclass(frozen=True, slots=True)
class Refused:
    """Frames of another length than the database says, or values out of its range: a sentence, their share, and the
    quantities that lack them.
    """

    text: str
    share: float
    quantities: frozenset[str]


def refused_in(
    messages: Sequence[Described], readings: Sequence[SignalReading], sources: Collection[Path]
) -> Iterator[Refused]:
    """The messages with a known unit that a map by these databases would refuse."""
    for one in messages:
        quantities = frozenset(filter(None, map(_quantity_of, one.message.signals.values())))
        counts, n_all = dict(one.heard.lengths), len(one.heard.kept)
        n_right = counts.pop(one.message.length, 0)
        if counts and quantities and one.message.source in sources:
            text = f"{one.message.name} ({one.heard.name}): {told_lengths(counts, n_all, one.message.length)}"
            yield Refused(text, 1.0 - n_right / n_all, quantities)
    for each in readings:
        if (n := len(each.beyond)) and each.described.message.source in sources:
            n_all, to_si = len(each.described.heard.kept), TO_SI[each.quantity]
            factor, unit = to_si[_unit_of(each.signal)], next(iter(to_si))
            low, high = (end * factor for end in each.signal.limits)
            read = float(each.beyond.min()), float(each.beyond.max())
            text = f"{each.name}: {told_share(n, n_all)} values read {told_range(read, (low, high), unit)}"
            yield Refused(text, n / n_all, frozenset({each.quantity}))


@dataclass(frozen=True, slots=True)
class MapFit:
    """A shipped map on one channel: the signals found, the missing ones, the mean of its vertical axis, and which
    frames do not fit it.
    """

    name: str
    channel: str | None
    found: tuple[Signal, ...]
    missing: tuple[Signal, ...]
    gravity_mps2: float
    causes: tuple[str, ...]

    @property
    def has_gravity(self) -> bool:
        """Whether gravity is on the mapped axis."""
        return abs(self.gravity_mps2 - STANDARD_GRAVITY_MPS2) < GRAVITY_TOLERANCE_MPS2

    @property
    def is_whole(self) -> bool:
        """Whether both inertial signals come, and gravity is on the mapped axis."""
        return self.has_gravity and {Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE} <= set(self.found)


def fits_of(heard: Sequence[Heard]) -> tuple[MapFit, ...]:
    """The maps with at least one signal found, the best first."""
    fits = []
    for name in shipped_maps():
        signal_map = load_signal_map(f"springscale:{name}")
        for channel in sorted({one.channel for one in heard}, key=str):
            on_it = [one for one in heard if one.channel == channel]
            ours = [one for one in on_it if any(ids.is_for(one.can_id) for ids in signal_map.filters)]
            decoder = Decoder(signal_map)
            motion = decoder.decode(merge_frames([one.frames for one in ours]))
            found = tuple(signal for signal in motion.signals if len(motion.of(signal)[1]))
            missing = tuple(signal for signal in motion.signals if signal not in found and signal not in ASIDE)
            vertical = motion.of(Signal.VERTICAL_ACCELERATION)[1]
            gravity_mps2 = float(np.median(vertical)) if len(vertical) else np.nan
            causes = tuple(cause.text for cause in decoder.causes())
            fits.append(MapFit(name, channel, found, missing, gravity_mps2, causes))
    return tuple(
        sorted((fit for fit in fits if fit.found), key=lambda fit: (not fit.is_whole, len(fit.missing), fit.name))
    )


@dataclass(frozen=True, slots=True)
class Look:
    """The findings about a log. ``lacking`` lists the obstacles; empty if it suffices. ``to_mend`` is what the signal
    map must say or have corrected before, such as which of several devices counts.
    """

    log: Path
    report: LogReport
    heard: tuple[Heard, ...]
    described: tuple[Described, ...]
    fits: tuple[MapFit, ...]
    readings: tuple[SignalReading, ...]
    found: tuple[FoundRole, ...]
    tilt_deg: float
    refused: tuple[Refused, ...]
    to_mend: tuple[str, ...]
    lacking: tuple[str, ...]
    faults: tuple[str, ...]

    @property
    def unsure_databases(self) -> tuple[str, ...]:
        """Shipped databases used by the findings, if no shipped map fits as it is."""
        sources = dict.fromkeys(found.reading.described.message.source for found in self.found)
        is_whole = any(fit.is_whole for fit in self.fits)
        return () if is_whole else tuple(path.name for path in sources if path in shipped_databases())

    @property
    def shipped(self) -> MapFit | None:
        """The only shipped map that fits as it is; None if none or several do."""
        whole = [fit for fit in self.fits if fit.is_whole]
        return whole[0] if len(whole) == 1 else None


def look(log: Path, databases: Sequence[Path] = ()) -> Look:
    """Inspect a log with these databases (default: those beside it or in the parent folder) and the shipped ones.

    Raises LogUnreadableError if there is no frame in it, SignalMapError for a given database that cannot be read.
    """
    heard, report = heard_in(log)
    own, faults = _messages_of(databases or _near(log), are_given=bool(databases))
    by_own = described(heard, own)
    others = [one for one in heard if not any(one is each.heard for each in by_own)]
    messages = (*by_own, *described(others, _messages_of(shipped_databases())[0]))
    origin_ns = min(int(one.kept.t_ns.min()) for one in heard)
    readings = tuple(reading for one in messages for reading in readings_of(one, origin_ns))
    heard_of = [reading for reading in readings if len(reading.x)]
    found = roles_of([r for r in heard_of if r.described in by_own] or heard_of)
    up = next((each for each in found if each.role is Signal.VERTICAL_ACCELERATION), None)
    tilt, fits = tilt_deg(readings, up) if up else float("nan"), fits_of(heard)
    sources = {one.message.source for one in by_own} | {each.reading.described.message.source for each in found}
    refused = tuple(refused_in(messages, readings, sources))
    lacking = tuple(_lacking(by_own, found, fits, readings, tilt, refused))
    causes = (cause for fit in fits if fit.is_whole for cause in fit.causes)
    to_mend = tuple(dict.fromkeys([*causes, *_rivals(found, readings)]))
    return Look(log, report, heard, messages, fits, readings, found, tilt, refused, to_mend, lacking, faults)


def _rivals(found: Sequence[FoundRole], readings: Sequence[SignalReading]) -> Iterator[str]:
    """Signals with a role that several J1939 devices send; speeds that agree are no matter."""
    for each in found:
        ours = each.reading
        same = [r for r in readings if r.signal is ours.signal and r.described.is_rival(ours.described) and len(r.x)]
        if ours.quantity == "speed":
            same = [r for r in same if abs(np.mean(r.x) - np.mean(ours.x)) > SAME_SPEED_SHARE * abs(np.mean(ours.x))]
        if same:
            unit = next(iter(TO_SI[ours.quantity]))
            devices = [
                f"{one.described.source_address:#04x} ({len(one.x):,} samples, usually {one.usual:.3g} {unit})"
                for one in (ours, *same)
            ]
            yield f"{ours.name} comes from {' and '.join(devices)}: state the source_address of one"


def _messages_of(
    paths: Iterable[Path], *, are_given: bool = False
) -> tuple[tuple[DatabaseMessage, ...], tuple[str, ...]]:
    """Every message of the databases, and the faults of those that cannot be read.

    Raises SignalMapError for a whole database among them if they are given.
    """
    messages: list[DatabaseMessage] = []
    faults: list[str] = []
    for path in paths:
        try:
            found, unsound = Databases(path, [path]).sound()
        except SignalMapError as fault:
            if are_given:
                raise
            faults.append(str(fault))
            continue
        messages += found
        faults += unsound
    return tuple(messages), tuple(faults)


def _near(log: Path) -> list[Path]:
    """Databases beside a log or else in the parent folder, as campaigns have a folder per drive."""
    folder = log.resolve().parent
    each = (sorted(path for path in place.glob("*") if path.suffix == ".dbc") for place in (folder, folder.parent))
    return next((found for found in each if found), [])


def _lacking(
    by_own: Sequence[Described],
    found: Sequence[FoundRole],
    fits: Sequence[MapFit],
    readings: Sequence[SignalReading],
    tilt: float,
    refused: Sequence[Refused],
) -> Iterator[str]:
    """The obstacles to weighing with this log, and their remedies."""
    whole = next((fit for fit in fits if fit.is_whole), None)
    roles = {each.role: each for each in found}
    up, pitch = roles.get(Signal.VERTICAL_ACCELERATION), roles.get(Signal.PITCH_RATE)
    lost = {quantity for one in refused if one.share >= TELLING_SHARE for quantity in one.quantities}
    if whole is None and not readings and not lost:
        if own := ", ".join(sorted({one.message.name for one in by_own})):
            units = ", ".join(TO_SI["acceleration"])
            yield f"no signal of {own} has a unit of acceleration ({units}): correct the unit in the database"
        else:
            yield "no database describes an acceleration in it: give the DBC of the sensor with --dbc"
        return
    as_told = "frames or values that would show it are refused, as told above"
    if whole is None and up is None:
        why = "the sensor is not in this log, or takes gravity off"
        yield f"no acceleration reads 9.8 m/s2: {as_told if 'acceleration' in lost else why}"
    if whole is None and tilt > MOST_TILT_DEG:
        yield f"the sensor leans by {tilt:.0f} degrees: mount it level, or have it turn its axes"
    if whole is None and up is not None and pitch is None:
        why = "drive with some braking, or name it yourself"
        yield f"no pitch rate could be told: {as_told if 'angular_rate' in lost else why}"
    if not {Signal.SPEED, Signal.WHEEL_SPEED} & set(whole.found if whole else roles):
        why = "add [signals.speed] from a GNSS receiver or the vehicle"
        yield f"no speed: {as_told if 'speed' in lost else why}"
    for each in (up, pitch):
        if each is not None and (rate_hz := each.reading.driving_rate_hz) < LEAST_RATE_HZ:
            yield f"{each.reading.name} comes {rate_hz:.3g} times a second; {LEAST_RATE_HZ:.0f} are needed"
