"""Inspects a log: its senders, their probable meaning, the axis with gravity, and whether it suffices."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from gateway.bus.frames import merge_frames
from gateway.bus.heard import Heard, heard_of, similar_to
from gateway.bus.logs import LogReport, motion_of_log, open_whole_log
from gateway.bus.signals import (
    Decoder,
    MappedMessage,
    SignalMap,
    id_name,
    load_signal_map,
    shipped_databases,
    shipped_map,
    shipped_maps,
)
from gateway.core.batch import GRAVITY_TOLERANCE_MPS2, RATE_MIN_SHARE
from gateway.core.settings import BatchSettings
from gateway.errors import SignalMapError
from gateway.offline.look.readings import Described, SignalReading, databases_of, described, readings_of
from gateway.offline.look.roles import FoundRole, roles_of, tilt_deg
from gateway.records import ASIDE, F64, Signal
from gateway.units import STANDARD_GRAVITY_MPS2

NEEDED: Final = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE)


@dataclass(frozen=True, slots=True)
class MapFit:
    """A shipped map on one channel: the signals found, the missing ones, and the mean of its vertical axis."""

    name: str
    device: str
    channel: str | None
    found: tuple[Signal, ...]
    missing: tuple[Signal, ...]
    gravity_mps2: float

    @property
    def is_whole(self) -> bool:
        """Whether both inertial signals come, and gravity is on the mapped axis."""
        has_gravity = abs(self.gravity_mps2 - STANDARD_GRAVITY_MPS2) < GRAVITY_TOLERANCE_MPS2
        return has_gravity and all(signal in self.found for signal in NEEDED)


def fits_of(heard: Sequence[Heard]) -> tuple[MapFit, ...]:
    """The maps with at least one signal found, the best first."""
    fits = [fit for name in shipped_maps() for fit in _fits(name, heard)]
    return tuple(sorted(fits, key=lambda fit: (not fit.is_whole, len(fit.missing), fit.name)))


def _fits(name: str, heard: Sequence[Heard]) -> Iterator[MapFit]:
    signal_map = load_signal_map(f"springscale:{name}")
    device = shipped_map(name).read_text(encoding="utf-8").splitlines()[0].removeprefix("# ").rstrip(".")
    for channel in sorted({one.channel for one in heard}, key=str):
        ours = [one for one in heard if one.channel == channel and _is_mapped(one, signal_map)]
        if not ours:
            continue
        motion = Decoder(signal_map).decode(merge_frames([one.frames for one in ours]))
        found = tuple(signal for signal in motion.signals if len(motion.of(signal)[1]))
        missing = tuple(signal for signal in motion.signals if signal not in found and signal not in ASIDE)
        vertical = motion.of(Signal.VERTICAL_ACCELERATION)[1]
        if found:
            yield MapFit(name, device, channel, found, missing, float(np.median(vertical)) if len(vertical) else np.nan)


def _is_mapped(one: Heard, signal_map: SignalMap) -> bool:
    return any(m.id_filter.is_for(one.can_id) and m.length in one.lengths for m in signal_map.messages)


def heard_in(log: Path) -> tuple[tuple[Heard, ...], LogReport]:
    """Every identifier in order of channel and number. Raises LogUnreadableError if nothing can be read."""
    chunks, report = open_whole_log(log)
    of_all = heard_of(chunks)
    report.require_frames()
    channels = sorted(report.channels)
    if len(channels) < 2:
        return tuple(replace(one, channel=next(iter(channels), None)) for one in of_all), report
    by_channel = [heard_of(open_whole_log(log, channel)[0], channel) for channel in channels]
    return tuple(one for heard in by_channel for one in heard), report


_NO_POSITION: Final = re.compile(r"accura|error|std|dev|valid|ref|dest", re.IGNORECASE)
_STEP_M: Final = 2000.0  # chosen: between two frames; a larger step is not an odometer's

_LOOKED_FOR: Final[tuple[tuple[Signal, str, re.Pattern[str], Callable[[F64], bool]], ...]] = (
    (Signal.LATITUDE, "angle", re.compile(r"latitude|(?:^|_)lat(?:_|$)", re.IGNORECASE), lambda x: _is_angle(x, 90.0)),
    (
        Signal.LONGITUDE,
        "angle",
        re.compile(r"longitude|(?:^|_)lon(?:g)?(?:_|$)", re.IGNORECASE),
        lambda x: _is_angle(x, 180.0),
    ),
    (
        Signal.ODOMETER,
        "distance",
        re.compile(r"odo|mileage|(?:vehicle|total|trip)_?distance|distance_?(?:total|trip)", re.IGNORECASE),
        lambda x: bool(np.all(np.diff(x) >= 0.0) and np.all(np.diff(x) < _STEP_M)),
    ),
)


def journey_of(readings: Sequence[SignalReading]) -> tuple[FoundRole, ...]:
    """Latitude, longitude and odometer, by a signal's name and values; the finest of each."""
    found = []
    for role, quantity, name, fits in _LOOKED_FOR:
        named = [
            r for r in readings
            if r.quantity == quantity and name.search(r.signal.name) and not _NO_POSITION.search(r.signal.name)
        ]  # fmt: skip
        good = [r for r in named if len(r.x) > 1 and fits(r.x)]
        if good:
            finest = min(good, key=lambda r: (abs(r.signal.field.scale), -r.rate_hz))
            found.append(FoundRole(role, finest, 1, "its name says so, and it reads like one"))
    return tuple(found)


def _is_angle(x: F64, most_deg: float) -> bool:
    """Whether these are angles; a receiver without a fix mostly sends 0 or a value out of range."""
    return bool(np.all(np.abs(x) <= most_deg) and np.any(x != 0.0))


def why_silent(log: Path, signal_map: SignalMap, signal: Signal) -> str:
    """The reason in words. Reads the log once or twice more; raises LogUnreadableError as every reader does."""
    message = signal_map.message_of(signal)
    motions, _, decoder = motion_of_log(log, signal_map)
    for _ in motions:
        pass
    refused = decoder.counts[signal].rejected
    if n := sum(refused.values()):
        reasons = ", ".join(f"{count} {reason.replace('_', ' ')}" for reason, count in sorted(refused.items()))
        return f"{n} frames of {_named(message)} came, none valid: {reasons}"
    if decoder.counts[signal].samples:
        return f"{decoder.counts[signal].samples} frames of {_named(message)} came, none of them within the run"
    similar = similar_to(message, signal_map, heard_in(log)[0])
    instead = f"similar: {'; '.join(similar)}" if similar else "and no identifier like it"
    on = f" on {signal_map.channel}" if signal_map.channel else ""
    return f"nothing of {_named(message)} came{on}; {instead}"


def _named(message: MappedMessage) -> str:
    return f"{message.name} ({id_name(message.frame_id)})"


LEAST_RATE_HZ = RATE_MIN_SHARE * BatchSettings().rate_hz
MOST_TILT_DEG = 15.0  # chosen: 3 % of gravity; beyond it the horizontal axes mix in noticeably


@dataclass(frozen=True, slots=True)
class Look:
    """The findings about a log. ``lacking`` lists the obstacles; empty if it suffices."""

    log: Path
    report: LogReport
    duration_s: float
    heard: tuple[Heard, ...]
    described: tuple[Described, ...]
    fits: tuple[MapFit, ...]
    readings: tuple[SignalReading, ...]
    found: tuple[FoundRole, ...]
    tilt_deg: float
    lacking: tuple[str, ...]
    faults: tuple[str, ...]

    @property
    def accelerations(self) -> tuple[SignalReading, ...]:
        """Every acceleration with a sample."""
        return tuple(r for r in self.readings if r.quantity == "acceleration" and len(r.x))

    @property
    def unsure_databases(self) -> tuple[str, ...]:
        """Shipped databases used by the findings, if no shipped map fits as it is."""
        if any(fit.is_whole for fit in self.fits):
            return ()
        sources = dict.fromkeys(found.reading.described.message.source for found in self.found)
        return tuple(path.name for path in sources if path in shipped_databases())

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
    own, faults = databases_of(databases or _near(log))
    if databases and faults:
        raise SignalMapError(faults[0])
    shipped, _ = databases_of(shipped_databases())
    by_own = described(heard, own)
    others = [one for one in heard if not any(one is each.heard for each in by_own)]
    messages = (*by_own, *described(others, shipped))
    origin_ns = min(int(one.frames.t_ns.min()) for one in heard)
    readings = tuple(reading for one in messages for reading in readings_of(one, origin_ns))
    chosen = [r for r in readings if r.described in by_own] or readings
    found = (*roles_of(chosen), *journey_of(chosen))
    up = next((each for each in found if each.role is Signal.VERTICAL_ACCELERATION), None)
    tilt = tilt_deg(readings, up) if up else float("nan")
    fits = fits_of(heard)
    return Look(
        log, report, max(one.duration_s for one in heard), heard, messages, fits, readings, found, tilt,
        tuple(_lacking(found, fits, readings, tilt)), faults,
    )  # fmt: skip


def _near(log: Path) -> list[Path]:
    """Databases beside a log or else in the parent folder, as campaigns have a folder per drive."""
    folder = log.resolve().parent
    places = [(place, kinds) for kinds in (("dbc",), ("kcd", "arxml", "sym")) for place in (folder, folder.parent)]
    each = (sorted(path for kind in kinds for path in place.glob(f"*.{kind}")) for place, kinds in places)
    return next((found for found in each if found), [])


def _lacking(
    found: Sequence[FoundRole], fits: Sequence[MapFit], readings: Sequence[SignalReading], tilt: float
) -> Iterator[str]:
    """The obstacles to weighing with this log, and their remedies."""
    if any(fit.is_whole for fit in fits):
        whole = next(fit for fit in fits if fit.is_whole)
        if not {Signal.SPEED, Signal.WHEEL_SPEED} & set(whole.found):
            yield "no speed: add [signals.speed] from a GNSS receiver or the vehicle"
        return
    roles = {each.role: each for each in found}
    up = roles.get(Signal.VERTICAL_ACCELERATION)
    if not readings:
        yield "no database describes an acceleration in it: give the DBC of the sensor with --dbc"
        return
    if up is None:
        yield "no acceleration reads 9.8 m/s2: the sensor is not in this log, or takes gravity off"
    elif tilt > MOST_TILT_DEG:
        yield f"the sensor leans by {tilt:.0f} degrees: mount it level, or have it turn its axes"
    if up is not None and Signal.PITCH_RATE not in roles:
        yield "no pitch rate could be told: drive with some braking, or name it yourself"
    if not {Signal.SPEED, Signal.WHEEL_SPEED} & roles.keys():
        yield "no speed: add [signals.speed] from a GNSS receiver or the vehicle"
    for each in (up, roles.get(Signal.PITCH_RATE)):
        if each is not None and each.reading.rate_hz < LEAST_RATE_HZ:
            yield f"{each.reading.name} comes {each.reading.rate_hz:.0f} times a second; {LEAST_RATE_HZ:.0f} are needed"
