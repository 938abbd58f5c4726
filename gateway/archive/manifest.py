"""The manifest of an archive: the vehicles' log folders, with the signal map and calibration for each span of time.

TOML. Paths in it are relative to the manifest, which may be in an object store.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, time
from functools import cache
from pathlib import Path, PurePosixPath
from posixpath import normpath
from typing import Annotated, Any, Final

from pydantic import AwareDatetime, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from gateway.archive.places import Location, place_of
from gateway.config import BatchSection, EstimatorName
from gateway.config.sections import OF_CALIBRATION, LimitKg
from gateway.core.batch_settings import BatchSettings
from gateway.core.weights.limits import Limits
from gateway.errors import ConfigurationError
from gateway.files.toml_file import checked, read_toml
from gateway.setup import Setup, load_setup
from gateway.units import NS_PER_S

NAME: Final = "archive.toml"  # of a folder's own manifest
FOREVER_NS: Final = (1 << 63) - 1  # the largest 64-bit integer


def _instant(told: Any) -> Any:
    """A date means its first instant, UTC."""
    if isinstance(told, date) and not isinstance(told, datetime):
        return datetime.combine(told, time(), UTC)
    return told


Instant = Annotated[AwareDatetime, BeforeValidator(_instant)]


class ManifestTable(BaseModel):
    """A table of the file."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Means(ManifestTable):
    """How logs are read and weights judged: the top of the file holds for every vehicle, an entry for its own."""

    signals: str | None = Field(None, description="signal map: a TOML file, or springscale:NAME")
    calibration: str | None = Field(None, description="calibration file; without it batches carry reasons only")
    estimator: EstimatorName | None = Field(None, description="which estimator answers [default: the file's first]")
    gross_limit_kg: LimitKg = Field(None, description=f"permitted gross weight {OF_CALIBRATION}")
    front_axle_limit_kg: LimitKg = Field(None, description=f"permitted load of the front axle {OF_CALIBRATION}")
    rear_axle_limit_kg: LimitKg = Field(None, description=f"permitted load of the rear axle {OF_CALIBRATION}")
    front_wheel_limit_kg: LimitKg = Field(None, description=f"permitted load of each front wheel {OF_CALIBRATION}")
    rear_wheel_limit_kg: LimitKg = Field(None, description=f"the same at the rear {OF_CALIBRATION}")


class VehicleEntry(Means):
    """[[vehicles]]: one vehicle, for all time or for a span of it. A vehicle may have several entries."""

    id: str | None = Field(
        None, pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}$", description="the vehicle's name [default: its VIN]"
    )
    vin: str | None = Field(None, pattern=r"^[A-HJ-NPR-Z0-9]{17}$", description="vehicle identification number")
    logs: str | None = Field(None, description="folder of its logs, below the top's, or a URL [default: its id]")
    since: Instant | None = Field(None, description="counts for logs that begin then or later; a day, or with a zone")
    until: Instant | None = Field(None, description="counts for logs that begin earlier than that")

    @model_validator(mode="after")
    def _makes_sense(self) -> "VehicleEntry":
        if self.id is None and self.vin is None:
            raise ValueError("give id or vin: nothing tells whose logs these are")
        if self.since and self.until and self.since >= self.until:
            raise ValueError("since must be before until")
        return self

    @property
    def name(self) -> str:
        """The vehicle's name in the data set."""
        return self.id or self.vin or ""

    def covers(self, other: "VehicleEntry") -> bool:
        """Whether both apply at some instant."""
        mine, theirs = self.span_ns, other.span_ns
        return mine[0] < theirs[1] and theirs[0] < mine[1]

    @property
    def span_ns(self) -> tuple[int, int]:
        """The first instant at which it applies, and the first at which it no longer does."""
        since_ns = -FOREVER_NS if self.since is None else _ns(self.since)
        return since_ns, FOREVER_NS if self.until is None else _ns(self.until)


class ManifestFile(Means):
    """The whole file."""

    logs: str = Field(".", description="folder below which the vehicles' folders are, or a URL")
    batch: BatchSection = BatchSection()
    vehicles: tuple[VehicleEntry, ...] = Field((), description="one table a vehicle and span of time")


@dataclass(frozen=True, slots=True)
class Assignment:
    """One vehicle's logs for a span of time, and how they are read."""

    vehicle: str
    vin: str | None
    logs: Location
    shown: str  # of its folder, as the data set names its logs
    span_ns: tuple[int, int]
    setup: Setup


@dataclass(frozen=True, slots=True)
class Manifest:
    """A checked archive: all its signal maps and calibrations could be loaded."""

    where: str
    assignments: tuple[Assignment, ...]
    settings: BatchSettings


def load_manifest(named: str) -> Manifest:
    """The manifest ``named``, or the one in the folder ``named``. Raises ConfigurationError naming every fault."""
    base, name, content = _found(named)
    where = base.path(name)
    told = checked(read_toml(where, read=lambda _: content), where, ManifestFile)
    entries = told.vehicles
    if not entries:
        raise ConfigurationError(f"{where}: names no vehicle; write [[vehicles]] with id or vin for each")
    _require_distinct(entries, where)

    @cache
    def load(signals: str, calibration: str | None, estimator: str | None, limits: Limits) -> Setup:
        named = signals if signals.startswith("springscale:") else base.path(signals)
        held = base.path(calibration) if calibration else None
        return load_setup(named, held, estimator, read=lambda path: _content(base, path), limits=limits)

    found = tuple(_assignment(base, told, entry, load, f"{where}: vehicles[{i}]") for i, entry in enumerate(entries, 1))
    return Manifest(str(where), found, told.batch.for_core())


def _assignment(base: Location, told: ManifestFile, entry: VehicleEntry, load: Any, where: str) -> Assignment:
    signals = entry.signals or told.signals
    if signals is None:
        raise ConfigurationError(f"{where}.signals: missing; give it here, or at the top for every vehicle")
    try:
        limits = Limits.of(told).overridden_by(Limits.of(entry))
        setup = load(signals, entry.calibration or told.calibration, entry.estimator or told.estimator, limits)
    except ConfigurationError as fault:
        raise ConfigurationError(f"{where}: {fault}") from None
    folder = entry.logs or entry.name
    place = _below(_below(base, told.logs), folder)
    return Assignment(entry.name, entry.vin, place, folder.rstrip("/"), entry.span_ns, setup)


def _found(named: str) -> tuple[Location, str, bytes]:
    """Folder, name and content of the manifest."""
    is_file = named.endswith(".toml")
    folder, _, name = named.rpartition("/") if is_file else (named, "", NAME)
    base = place_of(folder or (Path("/") if named.startswith("/") else Path()))
    where = base.path(name)
    try:
        return base, name, _content(base, where)
    except (FileNotFoundError, NotADirectoryError):
        lacks = f"{base}: has no {NAME}, which tells whose logs lie where; write one, or name yours"
        raise ConfigurationError(f"{where}: no such file" if is_file else lacks) from None
    except OSError as fault:
        raise ConfigurationError(f"{where}: cannot be read: {fault.strerror or fault}") from None


def _content(base: Location, path: Path) -> bytes:
    """The content of a file beside the manifest. Raises OSError or PlaceError."""
    return path.read_bytes() if base.local("") is not None else base.read(path.relative_to(base.path("")).as_posix())


def _below(base: Location, named: str) -> Location:
    """A folder in a manifest: another place if it is a URL or an absolute path."""
    if "://" in named or named.startswith("/"):
        return place_of(named)
    return base.at("" if named == "." else named.removeprefix("./"))


def _require_distinct(entries: Sequence[VehicleEntry], where: Path) -> None:
    """No instant of a vehicle or folder may belong to two entries."""
    by_key: defaultdict[str, list[tuple[int, VehicleEntry]]] = defaultdict(list)
    for i, entry in enumerate(entries, 1):
        by_key[f"vehicle {entry.name}"].append((i, entry))
        by_key[f"folder {_folder(entry)}"].append((i, entry))
    for i, entry in enumerate(entries, 1):
        folder = _folder(entry)
        above = [] if "://" in folder or folder == ".." else PurePosixPath(folder).parents
        told = {key: f"{key} is in" for key in (f"vehicle {entry.name}", f"folder {folder}")}
        told |= {f"folder {parent}": f"folder {folder} lies in that of" for parent in above}
        for key, what in told.items():
            for j, other in by_key.get(key, []):
                if entry.covers(other) and (j < i or (j > i and what.endswith("that of"))):
                    raise ConfigurationError(
                        f"{where}: vehicles[{i}]: {what} vehicles[{j}] too, at the same time; "
                        "part them by since and until"
                    )


def _folder(entry: VehicleEntry) -> str:
    """The folder in a normal form."""
    named = entry.logs or entry.name
    return named.rstrip("/") if "://" in named else normpath(named)


def _ns(instant: datetime) -> int:
    return round(instant.timestamp()) * NS_PER_S
