"""The manifest of an archive: the vehicles' log folders, with the signal map and calibration for each span of time.

TOML. Paths in it are relative to the manifest, which may be in an object store.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, time
from functools import lru_cache
from pathlib import Path, PurePosixPath
from posixpath import normpath
from typing import Annotated, Any, Final

from pydantic import AwareDatetime, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from gateway.archive.places import Location, place_of
from gateway.config import BatchSection, EstimatorName
from gateway.config.sections import OF_CALIBRATION, LimitKg
from gateway.core.settings import BatchSettings
from gateway.core.weights.limits import Limits
from gateway.errors import ConfigurationError
from gateway.setup import Setup, load_setup
from gateway.toml_file import checked, read_toml
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
    load = lru_cache(maxsize=None)(_Loader(base).setup)
    found = tuple(_assignment(base, told, entry, load, f"{where}: vehicles[{i}]") for i, entry in enumerate(entries, 1))
    return Manifest(str(where), found, told.batch.for_core())


@dataclass(frozen=True)
class _Loader:
    """Loads the manifest's files, relative to the manifest."""

    base: Location

    def read(self, path: Path) -> bytes:
        """The content of a file beside the manifest. Raises FileNotFoundError."""
        if self.base.local("") is not None:
            return path.read_bytes()
        return self.base.read(path.relative_to(self.base.path("")).as_posix())

    def setup(self, signals: str, calibration: str | None, estimator: str | None, limits: Limits) -> Setup:
        """A setup shared by all vehicles with the same inputs."""
        named = signals if signals.startswith("springscale:") else self.base.path(signals)
        return load_setup(
            named, self.base.path(calibration) if calibration else None, estimator, read=self.read, limits=limits
        )


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
    if named.endswith(".toml"):
        folder, _, name = named.rpartition("/")
        base = place_of(folder or (Path("/") if named.startswith("/") else Path()))
        return base, name, _read(base, name)
    base = place_of(named)
    try:
        return base, NAME, _Loader(base).read(base.path(NAME))
    except (FileNotFoundError, NotADirectoryError):
        raise ConfigurationError(
            f"{base}: has no {NAME}, which tells whose logs lie where; write one, or name yours"
        ) from None
    except OSError as fault:
        raise ConfigurationError(f"{base.path(NAME)}: cannot be read: {fault.strerror or fault}") from None


def _read(base: Location, name: str) -> bytes:
    try:
        return _Loader(base).read(base.path(name))
    except FileNotFoundError:
        raise ConfigurationError(f"{base.path(name)}: no such file") from None
    except OSError as fault:
        raise ConfigurationError(f"{base.path(name)}: cannot be read: {fault.strerror or fault}") from None


def _below(base: Location, named: str) -> Location:
    """A folder in a manifest: another place if it is a URL or an absolute path."""
    if "://" in named or named.startswith("/"):
        return place_of(named)
    return base.at("" if named == "." else named.removeprefix("./"))


def _require_distinct(entries: Sequence[VehicleEntry], where: Path) -> None:
    """No instant of a vehicle or folder may belong to two entries."""
    by_key: dict[str, list[tuple[int, VehicleEntry]]] = {}
    for i, entry in enumerate(entries, 1):
        for key in (f"vehicle {entry.name}", f"folder {_folder(entry)}"):
            _require_apart(i, entry, by_key.get(key, []), f"{where}: vehicles[{i}]: {key} is in")
            by_key.setdefault(key, []).append((i, entry))
    for i, entry in enumerate(entries, 1):
        for parent in _parent_folders(_folder(entry)):
            others = by_key.get(f"folder {parent}", [])
            _require_apart(i, entry, others, f"{where}: vehicles[{i}]: folder {_folder(entry)} lies in that of")


def _require_apart(i: int, entry: VehicleEntry, others: Sequence[tuple[int, VehicleEntry]], what: str) -> None:
    for j, other in others:
        if j != i and entry.covers(other):
            raise ConfigurationError(f"{what} vehicles[{j}] too, at the same time; part them by since and until")


def _folder(entry: VehicleEntry) -> str:
    """The folder in a normal form."""
    named = entry.logs or entry.name
    return named.rstrip("/") if "://" in named else normpath(named)


def _parent_folders(folder: str) -> list[str]:
    """The folders that contain this folder; none for a URL."""
    parents = [str(parent) for parent in PurePosixPath(folder).parents]
    return [] if "://" in folder or folder == ".." else parents


def _ns(instant: datetime) -> int:
    return round(instant.timestamp()) * NS_PER_S
