"""Signal maps: the TOML file that names our signals in a DBC, checked and resolved against its databases."""

from importlib.resources import files
from pathlib import Path
from typing import Final

from pydantic import BaseModel, ConfigDict, Field

from gateway.bus.signals.database import DatabaseMessage, closest, load_messages
from gateway.bus.signals.mapping import MappedMessage, MappedSignal, SignalMap, exact_filter, j1939_filter
from gateway.bus.signals.resolve import SignalEntry, resolve_signal
from gateway.errors import SignalMapError
from gateway.files.signed import Read
from gateway.records import EXTENDED_ID, Signal
from gateway.toml_file import load_toml

__all__ = ["SignalEntry", "SignalMap", "SignalMapFile", "load_signal_map", "shipped_map", "shipped_maps"]

SHIPPED_PREFIX: Final = "springscale:"


class SignalMapFile(BaseModel):
    """The signal map as written in its file."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    dbc: list[str] = Field(min_length=1, description="databases (DBC, KCD, ARXML, SYM), relative to this file")
    channel: str | None = Field(None, description="read only frames of this channel from log files")
    j1939: bool = Field(False, description="match 29-bit identifiers by PGN, whatever the source address")
    signals: dict[Signal, SignalEntry] = Field(min_length=1, description="our signals")


def load_signal_map(path: Path | str, read: Read = Path.read_bytes) -> SignalMap:
    """Read and resolve a signal map; ``springscale:NAME`` is one of those that come with the package.

    ``read`` checks required signatures (files.signed); files of the package need none.

    Raises SignalMapError naming the file, the key, what is wrong with it and how to mend it.
    """
    name = str(path)
    is_shipped = name.startswith(SHIPPED_PREFIX)
    file_path = shipped_map(name.removeprefix(SHIPPED_PREFIX)) if is_shipped else Path(path)
    reading = Path.read_bytes if is_shipped else read
    wanted = load_toml(file_path, SignalMapFile, SignalMapError, reading)
    databases = load_messages(file_path, [file_path.parent / dbc for dbc in wanted.dbc], reading)
    mapped: dict[str, list[MappedSignal]] = {}
    for signal, entry in wanted.signals.items():
        where = f"{file_path}: signals.{signal}"
        if entry.message not in databases:
            hint = closest(entry.message, databases)
            raise SignalMapError(f"{where}.message: the databases have no message {entry.message!r}; {hint}")
        resolved = resolve_signal(where, signal, entry, databases[entry.message], wanted.j1939)
        mapped.setdefault(entry.message, []).append(resolved)
    messages = tuple(_mapped_message(databases[m], tuple(signals), wanted.j1939) for m, signals in mapped.items())
    _require_distinct(messages, file_path)
    return SignalMap(str(path), wanted.channel, wanted.j1939, messages)


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


def _mapped_message(message: DatabaseMessage, signals: tuple[MappedSignal, ...], j1939: bool) -> MappedMessage:
    by_group = j1939 and bool(message.frame_id & EXTENDED_ID)
    id_filter = j1939_filter(message.frame_id) if by_group else exact_filter(message.frame_id)
    fields = {name: signal.field for name, signal in message.signals.items()}
    return MappedMessage(message.name, message.frame_id, id_filter, message.length, signals, fields)


def _require_distinct(messages: tuple[MappedMessage, ...], path: Path) -> None:
    for i, one in enumerate(messages):
        for other in messages[i + 1 :]:
            common = one.id_filter.mask & other.id_filter.mask
            if (one.id_filter.can_id ^ other.id_filter.can_id) & common == 0:
                raise SignalMapError(
                    f"{path}: messages {one.name!r} and {other.name!r} are the same frames on the bus; "
                    "map all their signals from one of them"
                )
