"""A campaign with its logs in one archive, for sharing: the drives, their loads, and the permission to use them.

The archive has campaign.toml, its signal map and databases, contribution.toml, and of each log only the mapped frames,
without the position: no other bus traffic leaves the vehicle. The same folder gives the same bytes.
"""

import gzip
import io
import re
import tomllib
import zipfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, Literal

from pydantic import Field

from gateway.bus.frames import join, take
from gateway.bus.logs import write_candump
from gateway.bus.logs.open import open_log
from gateway.bus.signals import SHIPPED_PREFIX, Decoder, SignalMap, load_signal_map
from gateway.bus.signals.mapping import MappedMessage
from gateway.calibration.campaign_file import Campaign, RunTable, file_sha256, load_campaign
from gateway.errors import CampaignError, ConfigurationError
from gateway.files.toml_file import load_toml, read_toml
from gateway.files.whole import refusal_told, written_whole
from gateway.records import Frames, Signal
from gateway.stated.facts import Part
from gateway.units import NS_PER_S

CAMPAIGN: Final = "campaign.toml"
CONTRIBUTION: Final = "contribution.toml"
NEEDED: Final = (Signal.VERTICAL_ACCELERATION, Signal.PITCH_RATE, Signal.SPEED)
POSITION: Final = frozenset({Signal.LATITUDE, Signal.LONGITUDE})
_LOG_LINE: Final = re.compile(r"""^([ \t]*log[ \t]*=[ \t]*)(?:"(?:[^"\\]|\\.)*"|'[^']*')""", re.MULTILINE)
_ZIP_EPOCH: Final = (1980, 1, 1, 0, 0, 0)  # the earliest date that the format has
OnRun = Callable[[int, int], None]

TEMPLATE: Final = """\
[permission]
given_by = "a name, or a pseudonym"
licence = "CC-BY-4.0"            # or CC0-1.0
may_be_published = true          # I drove this, or may speak for who did

[truth]
weighed_by = "weighbridge"       # or axle_pads, wheel_pads, platform_scale, bathroom_scale, stated_by_maker
scale_std_kg = 10.0              # how far its figures scatter about the truth
note = "slip of every run; driver 82 kg and half a tank belong to the empty van"

[vehicle]
make_and_model = "make, model, year"
suspension = "coil springs in front, leaf springs at the rear"
tyres = "205/75 R16, 3.5 bar"

[sensor]
device = "what was it, at which rate"
mounting = "where, and how it was fixed"
"""


class Permission(Part):
    """[permission]: who permits which use."""

    given_by: str = Field(min_length=1)
    licence: Literal["CC0-1.0", "CC-BY-4.0"]
    may_be_published: Literal[True]


class Truth(Part):
    """[truth]: the source of the payloads in campaign.toml."""

    weighed_by: Literal["weighbridge", "axle_pads", "wheel_pads", "platform_scale", "bathroom_scale", "stated_by_maker"]
    scale_std_kg: float = Field(gt=0.0, le=1000.0)
    note: str = ""


class VehicleNote(Part):
    """[vehicle]: facts that campaign.toml has no key for."""

    make_and_model: str = Field(min_length=1)
    suspension: str = ""
    tyres: str = ""


class SensorNote(Part):
    """[sensor]: the sensor and its mounting."""

    device: str = Field(min_length=1)
    mounting: str = Field(min_length=1)


class Contribution(Part):
    """The content of contribution.toml."""

    permission: Permission
    truth: Truth
    vehicle: VehicleNote
    sensor: SensorNote


@dataclass(frozen=True, slots=True)
class PackedRun:
    """One run in the archive; its frames are those of the signal map."""

    number: int
    log: str
    payload_kg: float | None
    duration_s: float
    n_frames: int


@dataclass(frozen=True, slots=True)
class Bundle:
    """The result of packing."""

    output: Path
    contribution: Contribution
    runs: tuple[PackedRun, ...]

    def to_json(self) -> dict[str, Any]:
        return {
            "written": str(self.output),
            "sha256": file_sha256(self.output),
            "licence": self.contribution.permission.licence,
            "runs": [asdict(run) for run in self.runs],
        }


def pack(folder: Path, output: Path, *, with_position: bool = False, on_run: OnRun = lambda done, of: None) -> Bundle:
    """Write the archive. Raises ConfigurationError, CampaignError or LogUnreadableError naming what to correct."""
    if output.exists():
        raise ConfigurationError(f"{output}: is there already, and is not written over; name another --output")
    campaign = load_campaign(folder / CAMPAIGN)
    contribution = _contribution(folder / CONTRIBUTION)
    signal_map = load_signal_map(campaign.signals)
    left_out = () if with_position else _position_messages(signal_map)
    members = {CONTRIBUTION: (folder / CONTRIBUTION).read_bytes(), **_map_members(campaign, folder)}
    runs = []
    with TemporaryDirectory(prefix="springscale-") as scratch:
        for number, run in enumerate(campaign.runs, 1):
            on_run(number - 1, len(campaign.runs))
            log = Path(scratch) / f"{number:02d}.log"
            frames = _mapped_frames(campaign, run, signal_map, left_out)
            write_candump(frames, signal_map.channel or "can0", log)
            name = f"runs/{log.name}.gz"
            members[name] = gzip.compress(log.read_bytes(), 6, mtime=0)
            span_s = float(frames.t_ns[-1] - frames.t_ns[0]) / NS_PER_S
            runs.append(PackedRun(number, name, run.payload_kg, span_s, len(frames)))
    members[CAMPAIGN] = _renamed(folder / CAMPAIGN, [run.log for run in runs])
    with refusal_told(output, ConfigurationError), written_whole(output) as file:
        file.write(_zipped(members))
    on_run(len(runs), len(runs))
    return Bundle(output, contribution, tuple(runs))


def _contribution(path: Path) -> Contribution:
    if not path.is_file():
        raise ConfigurationError(f"{path}: no such file. Write it like this:\n\n{TEMPLATE}")
    return load_toml(path, Contribution)


def _position_messages(signal_map: SignalMap) -> tuple[MappedMessage, ...]:
    """Messages with the vehicle's position. Raises ConfigurationError for one that also has other signals."""
    telling = [m for m in signal_map.messages if POSITION & {mapped.signal for mapped in m.signals}]
    for message in telling:
        others = sorted({str(mapped.signal) for mapped in message.signals} - set(map(str, POSITION)))
        if others:
            raise ConfigurationError(
                f"message {message.name} carries the position together with {', '.join(others)}: take the position out "
                "of the signal map, or pack it too by --with-position"
            )
    return tuple(telling)


def _map_members(campaign: Campaign, folder: Path) -> dict[str, bytes]:
    """The signal map and its databases by their paths in the folder; none for a shipped map."""
    if campaign.signals.startswith(SHIPPED_PREFIX):
        return {}
    path, root = Path(campaign.signals), folder.resolve()
    members = {}
    for each in (path, *(path.parent / name for name in read_toml(path)["dbc"])):
        if not each.resolve().is_relative_to(root):
            raise ConfigurationError(f"{each}: lies outside {folder}: copy it into it, and name it there")
        members[each.resolve().relative_to(root).as_posix()] = each.read_bytes()
    return members


def _mapped_frames(
    campaign: Campaign, run: RunTable, signal_map: SignalMap, left_out: Sequence[MappedMessage]
) -> Frames:
    """The frames of the mapped signals. Raises CampaignError if a needed signal is absent."""
    chunks, report = open_log(campaign.log_of(run), signal_map)
    frames = join(list(chunks), signal_map.payload_width)
    report.require_frames()
    for message in left_out:
        frames = take(frames, ~message.id_filter.matches(frames.can_id))
    motion = Decoder(signal_map).decode(frames)
    for signal in NEEDED:
        if signal in motion.signals and not len(motion.of(signal)[1]):
            raise CampaignError(f"{campaign.path}: {run.log}: has no valid {signal}: `springscale look` says why")
    return frames


def _renamed(path: Path, logs: Sequence[str]) -> bytes:
    """campaign.toml with the log names of the archive and no other change."""
    names: Iterator[str] = iter(logs)
    renamed = _LOG_LINE.sub(lambda line: f'{line[1]}"{next(names, "")}"', path.read_text(encoding="utf-8"))
    expected = read_toml(path)
    for table, name in zip(expected["runs"], logs, strict=True):
        table["log"] = name
    if tomllib.loads(renamed) != expected:
        raise CampaignError(f"{path}: write each run as a [[runs]] table of its own, with its log on a line of its own")
    return renamed.encode("utf-8")


def _zipped(members: dict[str, bytes]) -> bytes:
    """A zip without dates; logs are already compressed."""
    whole = io.BytesIO()
    with zipfile.ZipFile(whole, "w") as archive:
        for name, content in sorted(members.items()):
            kind = zipfile.ZIP_STORED if name.endswith(".gz") else zipfile.ZIP_DEFLATED
            archive.writestr(zipfile.ZipInfo(name, _ZIP_EPOCH), content, kind)
    return whole.getvalue()
