"""Signal maps: the TOML file that names our signals in a DBC, each entry checked and resolved against its databases."""

import math
from collections.abc import Iterator
from importlib.resources import files
from itertools import combinations
from pathlib import Path
from typing import Annotated, Final, Literal
from zoneinfo import ZoneInfo

from pydantic import BaseModel, ConfigDict, Field

from gateway.bus.signals.bit_field import BitField, Coding
from gateway.bus.signals.dbc import DatabaseMessage, Databases, DatabaseSignal, closest
from gateway.bus.signals.mapping import (
    CAN_FD_BYTES,
    QUANTITIES,
    SOURCE_ADDRESS,
    Condition,
    MappedMessage,
    MappedSignal,
    SignalMap,
    exact_filter,
    j1939_filter,
)
from gateway.errors import SignalMapError
from gateway.files.toml_file import Read, load_toml
from gateway.records import EXTENDED_ID, Signal
from gateway.units import si_factor, zone_of

FEWEST_COUNTER_BITS: Final = 2  # chosen: one bit cannot tell a lost frame from two
MOST_COUNTER_BITS: Final = 32  # chosen: no frames are lost round a longer one
_EXACT_INTEGERS: Final = 1 << 53  # a double holds every integer up to here

Accepted = int | float | str
Finite = Annotated[float, Field(allow_inf_nan=False)]


class SignalEntry(BaseModel):
    """[signals.NAME]: the source of one of our signals."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    message: str = Field(description="name of the message in the DBC")
    signal: str = Field(description="name of the signal in that message")
    sign: Literal[-1, 1] = Field(1, description="-1 if the device counts against our axis (ISO 8855)")
    unit: str | None = Field(None, description="unit of the DBC's physical values; overrides the DBC's own")
    latency_s: float = Field(0.0, ge=0.0, le=10.0, description="delay between measurement and sending")
    valid_when: dict[str, Accepted | list[Accepted]] = Field(
        default_factory=dict, description="signals of the same message and the values under which this one counts"
    )
    counter: str | None = Field(
        None,
        description="signal of the same message that counts its frames: it distinguishes late frames from lost ones",
    )
    source_address: int | None = Field(
        None, ge=0, le=253, description="with j1939: count only frames of this device; without it those of every device"
    )
    minimum: Finite | None = Field(None, description="least valid value in SI; overrides the DBC's range")
    maximum: Finite | None = Field(None, description="greatest valid value in SI; overrides the DBC's range")


def resolve_signal(
    where: str, signal: Signal, entry: SignalEntry, message: DatabaseMessage, j1939: bool
) -> MappedSignal:
    """Resolve an entry of the map against its message. ``where`` begins every SignalMapError."""
    named = _decodable(f"{where}.signal", entry.signal, message)
    try:
        to_si = entry.sign * si_factor(QUANTITIES[signal], named.unit if entry.unit is None else entry.unit)
    except SignalMapError as fault:
        raise SignalMapError(f"{where}.unit: {fault}") from None
    minimum, maximum = _valid_range(where, entry, named, to_si)
    is_state, names = QUANTITIES[signal] == "state", named.choices.values()
    return MappedSignal(
        signal=signal,
        dbc_signal=named.name,
        field=named.field,
        to_si=to_si,
        minimum=minimum,
        maximum=maximum,
        latency_s=entry.latency_s,
        multiplexed_by=_multiplexers(where, named, message),
        valid_when=tuple(one for each in entry.valid_when.items() for one in _conditions(where, *each, message)),
        rejects_j1939_codes=(j1939 and bool(message.frame_id & EXTENDED_ID) and named.field.coding is Coding.UNSIGNED),
        # raw bits that the database gives a name, such as Error: a measured signal has numbers, a name is none
        named_codes=() if is_state else tuple(sorted({_bits_of(raw, named.field) for raws in names for raw in raws})),
        counter=None if entry.counter is None else _counter(f"{where}.counter", entry.counter, message),
    )


def _counter(where: str, name: str, message: DatabaseMessage) -> BitField:
    """The field that counts the frames of the message."""
    counter = _decodable(where, name, message)
    field = counter.field
    if field.coding is Coding.FLOAT or not FEWEST_COUNTER_BITS <= field.length <= MOST_COUNTER_BITS:
        kind = "a float" if field.coding is Coding.FLOAT else "an integer"
        raise SignalMapError(
            f"{where}: {name!r} is {kind} of {field.length} bits; "
            f"a message counter is an integer of {FEWEST_COUNTER_BITS} to {MOST_COUNTER_BITS} bits"
        )
    if counter.multiplexer is not None:
        raise SignalMapError(f"{where}: {name!r} is not in every frame of {message.name!r} (it is multiplexed)")
    return field


def _find(where: str, name: str, message: DatabaseMessage) -> DatabaseSignal:
    if name in message.twins:
        raise SignalMapError(
            f"{where}: message {message.name!r} has several signals {name!r}; rename all but one in "
            f"{message.source.name}"
        )
    if name in message.signals:
        return message.signals[name]
    raise SignalMapError(f"{where}: message {message.name!r} has no signal {name!r}; {closest(name, message.signals)}")


def _decodable(where: str, name: str, message: DatabaseMessage) -> DatabaseSignal:
    """The signal of this name, if the decoder can read it. Raises SignalMapError."""
    signal = _find(where, name, message)
    if (fault := next(_faults_of(signal.field, message), None)) is not None:
        raise SignalMapError(f"{where}: {name!r} {fault}; correct {message.source.name}")
    return signal


def _faults_of(field: BitField, message: DatabaseMessage) -> Iterator[str]:
    """Why the decoder cannot read a field, the first fault first."""
    if field.coding is Coding.FLOAT and field.length not in (16, 32, 64):
        yield f"is a float of {field.length} bits; 16, 32 or 64 are possible"
    if not 1 <= field.length <= 64:
        yield f"has {field.length} bits; 1 to 64 are possible"
    if not 0 <= message.length <= CAN_FD_BYTES:
        yield f"is in {message.name!r}, which has {message.length} bytes; a CAN frame carries at most 64"
    if field.start < 0:
        yield f"begins at bit {field.start}"
    if field.n_bytes > message.length:
        yield f"ends in byte {field.n_bytes}, but {message.name!r} has {message.length}"
    if not (math.isfinite(field.scale) and math.isfinite(field.offset)) or field.scale == 0.0:
        yield f"has scale {field.scale:g} and offset {field.offset:g}"
    is_integer = field.coding is not Coding.FLOAT and field.scale.is_integer() and field.offset.is_integer()
    if is_integer and max(map(abs, (*field.raw_range, *field.physical_range))) > _EXACT_INTEGERS:
        yield "counts beyond 2^53, which a double cannot hold exactly"


def _valid_range(where: str, entry: SignalEntry, named: DatabaseSignal, to_si: float) -> tuple[float, float]:
    """Least and greatest valid SI: of the entry, else of the database, else of the bits."""
    ends = sorted(end * to_si for end in named.limits)
    minimum = ends[0] if entry.minimum is None else entry.minimum
    maximum = ends[1] if entry.maximum is None else entry.maximum
    if minimum >= maximum:
        raise SignalMapError(f"{where}: minimum {minimum:g} is not below maximum {maximum:g} (both in SI)")
    return (minimum if math.isfinite(minimum) else math.nan), (maximum if math.isfinite(maximum) else math.nan)


def _multiplexers(where: str, signal: DatabaseSignal, message: DatabaseMessage) -> tuple[Condition, ...]:
    """The chain of multiplexers that put ``signal`` into a frame, outermost last."""
    chain: dict[str, Condition] = {}
    while signal.multiplexer is not None:
        if signal.multiplexer in chain:
            raise SignalMapError(f"{where}: {signal.name!r} selects itself; correct {message.source.name}")
        selector = _find(where, signal.multiplexer, message)
        bits = tuple(_bits_of(raw, selector.field) for raw in signal.multiplexer_ids)
        chain[selector.name] = Condition(selector.field, bits)
        signal = selector
    return tuple(chain.values())


def _conditions(
    where: str, name: str, allowed: Accepted | list[Accepted], message: DatabaseMessage
) -> tuple[Condition, ...]:
    """One entry of valid_when: the judged signal is in the frame, and has one of the values."""
    key = f"{where}.valid_when"
    judged = _decodable(key, name, message)
    choices = allowed if isinstance(allowed, list) else [allowed]
    if not choices:
        raise SignalMapError(f"{key}.{name}: an empty list allows no frame; name the values under which this counts")
    bits = [each for choice in choices for each in _allowed_bits(f"{key}.{name}", choice, judged)]
    return *_multiplexers(key, judged, message), Condition(judged.field, tuple(dict.fromkeys(bits)))


def _allowed_bits(where: str, allowed: Accepted, signal: DatabaseSignal) -> tuple[int, ...]:
    """The raw bits of a physical number, or all those that the database calls so."""
    field = signal.field
    if isinstance(allowed, str):
        if allowed not in signal.choices:
            raise SignalMapError(f"{where}: no value is called {allowed!r}; {closest(allowed, signal.choices)}")
        return tuple(_bits_of(raw, field) for raw in signal.choices[allowed])
    if field.coding is Coding.FLOAT:
        raise SignalMapError(f"{where}: {signal.name!r} is a float, which cannot be compared for equality")
    steps, (low, high) = (allowed - field.offset) / field.scale, field.raw_range
    raw = round(steps) if low - 1 < steps < high + 1 else low - 1  # beyond, and NaN: no step of the signal
    if not low <= raw <= high or not math.isclose(raw * field.scale + field.offset, allowed, abs_tol=1e-9):
        raise SignalMapError(f"{where}: {signal.name!r} can never be {allowed!r}")
    return (_bits_of(raw, field),)


def _bits_of(raw: int, field: BitField) -> int:
    return raw & ((1 << field.length) - 1)


SHIPPED_PREFIX: Final = "springscale:"


class SignalMapFile(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    dbc: list[str] = Field(min_length=1, description="DBC files, relative to this file")
    channel: str | None = Field(None, description="read only frames of this channel from log files")
    time_zone: str | None = Field(
        None, description="zone of logs whose date states none, such as Europe/Berlin; without it UTC"
    )
    j1939: bool = Field(False, description="match 29-bit identifiers by PGN, whatever the source address")
    signals: dict[Signal, SignalEntry] = Field(min_length=1, description="our signals")


def load_signal_map(path: Path | str, read: Read = Path.read_bytes) -> SignalMap:
    """Read and resolve a signal map; ``springscale:NAME`` is one of those that come with the package.

    ``read`` reads the map and its databases, unless they are the package's.

    Raises SignalMapError naming the file, the key, what is wrong with it and how to mend it.
    """
    file_path, wanted, databases = _opened(path, read)
    found: dict[str, DatabaseMessage] = {}
    mapped: dict[tuple[str, int | None], list[MappedSignal]] = {}
    for signal, entry in wanted.signals.items():
        where = f"{file_path}: signals.{signal}"
        if entry.message not in databases.names:
            hint = closest(entry.message, databases.names)
            raise SignalMapError(f"{where}.message: the databases have no message {entry.message!r}; {hint}")
        if entry.message not in found:
            found[entry.message] = databases.message(entry.message)
        resolved = resolve_signal(where, signal, entry, found[entry.message], wanted.j1939)
        if entry.source_address is not None and not (wanted.j1939 and found[entry.message].frame_id & EXTENDED_ID):
            raise SignalMapError(
                f"{where}.source_address: only messages with 29-bit identifiers have one, and with j1939 = true"
            )
        ours = mapped.setdefault((entry.message, entry.source_address), [])
        if (twin := next((one.signal for one in ours if one.field == resolved.field), None)) is not None:
            raise SignalMapError(
                f"{where}.signal: {entry.signal!r} is mapped as {twin} too; it can measure one of them"
            )
        ours.append(resolved)
    messages = tuple(
        _mapped_message(found[name], source, tuple(signals), wanted.j1939) for (name, source), signals in mapped.items()
    )
    _require_distinct(messages, file_path)
    return SignalMap(str(path), wanted.channel, wanted.j1939, messages, _zone(file_path, wanted.time_zone))


def unsound_messages(path: Path | str, read: Read = Path.read_bytes) -> tuple[str, ...]:
    """Messages of a map's databases that cannot be read, each with the reason: those it maps are none of them."""
    return tuple(_opened(path, read)[2].sound()[1])


def _opened(path: Path | str, read: Read) -> tuple[Path, SignalMapFile, Databases]:
    name = str(path)
    is_shipped = name.startswith(SHIPPED_PREFIX)
    file_path = shipped_map(name.removeprefix(SHIPPED_PREFIX)) if is_shipped else Path(path)
    reading = Path.read_bytes if is_shipped else read
    wanted = load_toml(file_path, SignalMapFile, SignalMapError, reading)
    return file_path, wanted, Databases(file_path, [file_path.parent / dbc for dbc in wanted.dbc], reading)


def _zone(path: Path, name: str | None) -> ZoneInfo | None:
    try:
        return None if name is None else zone_of(name)
    except ValueError as fault:
        raise SignalMapError(f"{path}: time_zone: {fault}") from None


def shipped_maps() -> tuple[str, ...]:
    """Names of the signal maps that come with the package."""
    names = (Path(entry.name) for entry in files("gateway.dbc").iterdir())
    return tuple(sorted(name.stem for name in names if name.suffix == ".toml"))


def shipped_databases() -> tuple[Path, ...]:
    """Paths of the DBC files that come with the package."""
    folder = Path(str(files("gateway.dbc")))
    return tuple(sorted(folder.glob("*.dbc")))


def shipped_map(name: str) -> Path:
    """Path of a signal map that comes with the package. Raises SignalMapError naming the available ones."""
    if name not in shipped_maps():
        raise SignalMapError(f"{SHIPPED_PREFIX}{name}: no such map; known are {', '.join(shipped_maps())}")
    return Path(str(files("gateway.dbc") / f"{name}.toml"))


def _mapped_message(
    message: DatabaseMessage, source_address: int | None, signals: tuple[MappedSignal, ...], j1939: bool
) -> MappedMessage:
    name, frame_id = message.name, message.frame_id
    is_group = j1939 and bool(frame_id & EXTENDED_ID)
    id_filter = j1939_filter(frame_id, source_address) if is_group else exact_filter(frame_id)
    if source_address is not None:
        name, frame_id = f"{name} of {source_address:#04x}", frame_id & ~SOURCE_ADDRESS | source_address
    fields = {name: signal.field for name, signal in message.signals.items()}
    return MappedMessage(name, frame_id, id_filter, message.length, signals, fields)


def _require_distinct(messages: tuple[MappedMessage, ...], path: Path) -> None:
    for one, other in combinations(messages, 2):
        common = one.id_filter.mask & other.id_filter.mask
        if (one.id_filter.can_id ^ other.id_filter.can_id) & common == 0:
            raise SignalMapError(
                f"{path}: messages {one.name!r} and {other.name!r} are the same frames on the bus; "
                "map all their signals from one of them, each or none with a source_address"
            )
