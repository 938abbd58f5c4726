"""The calibration file: versioned JSON whose id is the hash of its content. Written by the tool, never by hand."""

import copy
import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, Literal

from pydantic import Field, ValidationError

from gateway.calibration.file.line_part import LinePart
from gateway.calibration.file.parts import (
    CrossSpectrumPart,
    ExpectedErrorsPart,
    Part,
    ProvenancePart,
    RatioIndexPart,
    SeenPart,
    VehiclePart,
)
from gateway.calibration.file.sane import absurd
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.vehicle import Vehicle, sensor_offset_left
from gateway.errors import CalibrationFileError, LineError, UntrustedFileError
from gateway.files.signed import Read
from gateway.toml_file import describe_faults

if TYPE_CHECKING:
    from gateway.calibration.line import Sister

Content = dict[str, Any]
FIRST_VERSION: Final = 1

FORMAT: Final = "springscale-calibration"
VERSION: Final = 7


class CalibrationFile(Part):
    """The whole file but for its id."""

    format: Literal["springscale-calibration"] = FORMAT
    version: Literal[7] = VERSION
    migrated_from: str | None = Field(
        None, description="id of the file of an older version that this content was read from; null: written as it is"
    )
    vehicle: VehiclePart
    seen: SeenPart
    cross_spectrum: CrossSpectrumPart | None = None
    ratio_index: RatioIndexPart | None = None
    line: LinePart | None = Field(
        None, description="what sister vehicles told before it was driven; null: its own drives are all that it knows"
    )
    expected_errors: dict[str, ExpectedErrorsPart] = Field(
        default_factory=dict, description="by estimator: errors on runs left out of the fit"
    )
    warnings: tuple[str, ...] = ()
    provenance: ProvenancePart

    @property
    def id(self) -> str:
        """What estimates name: the hash of the file as it was first written, which a migration does not change."""
        return self.migrated_from or self.content_id

    @property
    def content_id(self) -> str:
        """sha256 of the canonical JSON of everything in the file but the id itself."""
        return content_id(self.model_dump(mode="json"))

    def to_json(self) -> str:
        """The file's text, id first."""
        content = {"id": self.content_id, **self.model_dump(mode="json")}
        return json.dumps(content, indent=1, allow_nan=False) + "\n"

    def for_core(self) -> CalibratedVehicle:
        """What the estimators need of it."""
        return CalibratedVehicle(
            id=self.id,
            vehicle=Vehicle(**dict(self.vehicle)),
            payload_seen_kg=self.seen.payload_kg,
            front_share_seen_pct=self.seen.front_share_pct,
            ratio_index=self.ratio_index.for_core() if self.ratio_index else None,
            cross_spectrum=self.cross_spectrum.for_core() if self.cross_spectrum else None,
        )

    def sister(self) -> "Sister":
        """What it tells of other vehicles of its line. Raises LineError where it holds no half-car."""
        from gateway.calibration.line import Sister  # noqa: PLC0415 # a service reads, and loads nothing that fits

        if self.cross_spectrum is None:
            raise LineError(
                f"{self.vehicle.name} ({self.id}): holds no cross_spectrum calibration, of which alone a line is made: "
                "calibrate it again without --estimator ratio_index"
            )
        line = self.line.for_core() if self.line else None
        return Sister(self.id, Vehicle(**dict(self.vehicle)), self.cross_spectrum.for_core(), line)

    @property
    def estimators(self) -> tuple[str, ...]:
        """Estimators that this file holds a calibration for; the service runs the first unless told otherwise."""
        held = {"cross_spectrum": self.cross_spectrum, "ratio_index": self.ratio_index}
        return tuple(name for name, part in held.items() if part is not None)


def content_id(content: dict[str, Any]) -> str:
    """sha256:... over the canonical JSON of ``content`` (keys sorted, no spaces), its own id left out."""
    rest = {key: part for key, part in content.items() if key != "id"}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return "sha256:" + hashlib.sha256(text.encode()).hexdigest()


def load_calibration(path: Path | str, read: Read = Path.read_bytes) -> CalibrationFile:
    """Reads, checks version, hash and shape; an older version is migrated, what it did not say is null.

    ``read`` sees to the signature where one is required (files.signed).

    Raises CalibrationFileError saying what to do.
    """
    path = Path(path)
    content = read_content(path, read)
    if content.get("format") != FORMAT:
        raise CalibrationFileError(f"{path}: not a springscale calibration file (format is {content.get('format')!r})")
    _refuse_unknown_version(path, content.get("version"))
    if not matches_its_id(content):
        raise CalibrationFileError(
            f"{path}: content does not match its id: the file was changed after it was written; "
            "restore it or calibrate again"
        )
    try:
        current = migrated(content, VERSION)
        held = CalibrationFile.model_validate({key: part for key, part in current.items() if key != "id"})
        held.for_core()  # a term or a model of another springscale is told here, with the file's name
        if held.line is not None:
            held.line.require_known()
        if (fault := absurd(held)) is not None:
            raise CalibrationFileError(fault)
    except CalibrationFileError as fault:
        raise CalibrationFileError(f"{path}: {fault}") from None
    except ValidationError as fault:
        raise CalibrationFileError(describe_faults(path, fault)) from None
    except (KeyError, TypeError, AttributeError, RecursionError):  # a migration met a shape that its version never had
        raise CalibrationFileError(
            f"{path}: not the shape of a calibration file of version {content['version']}: calibrate again"
        ) from None
    return held


def _refuse_unknown_version(path: Path, version: Any) -> None:
    if type(version) is not int or version < FIRST_VERSION:
        raise CalibrationFileError(
            f"{path}: calibration file version {version!r} was never written by any springscale: "
            "calibrate again with `springscale calibrate`"
        )
    if version > VERSION:
        raise CalibrationFileError(
            f"{path}: calibration file version {version}, this springscale reads up to version {VERSION}: "
            "use the springscale that wrote it, or calibrate again with this one"
        )


def matches_its_id(content: Content) -> bool:
    """False for a file that was changed since it was written."""
    try:
        return bool(content.get("id") == content_id(content))
    except ValueError:  # a number that is not finite, which is never written
        return False


def read_content(path: Path, read: Read) -> Content:
    """A file's JSON object. Raises CalibrationFileError where it is none."""
    try:
        content = json.loads(read(path).decode("utf-8"))
    except FileNotFoundError:
        raise CalibrationFileError(f"{path}: no such calibration file") from None
    except UntrustedFileError as fault:
        raise CalibrationFileError(str(fault)) from None
    except (OSError, UnicodeDecodeError) as fault:
        raise CalibrationFileError(f"{path}: cannot be read: {fault}") from None
    except (ValueError, RecursionError) as fault:  # a number of 5000 digits and brackets 5000 deep are no JSON for us
        raise CalibrationFileError(f"{path}: not valid JSON: {fault}") from None
    if not isinstance(content, dict):
        raise CalibrationFileError(f"{path}: not a springscale calibration file")
    return content


def _to_version_2(content: Content) -> None:
    """Version 2 says over which roads it was calibrated, and the expected errors of every estimator."""
    content["seen"]["roughness_mps2"] = None
    for estimator in ("cross_spectrum", "ratio_index"):
        if content[estimator] is not None:
            content["expected_errors"].setdefault(estimator, {"payload_rms_kg": None, "front_share_rms_pct": None})


def _to_version_3(content: Content) -> None:
    """Version 3 says where things are to the side. An offset of 0 was what stood there when nobody stated one."""
    vehicle = content["vehicle"]
    _, offset_std_m = sensor_offset_left(vehicle["sensor_offset_left_m"] or None)
    vehicle |= {"sensor_offset_left_std_m": offset_std_m, "track_width_m": None, "empty_cg_left_m": 0.0}
    vehicle |= {"front_wheel_limit_kg": None, "rear_wheel_limit_kg": None}
    if content["ratio_index"] is not None:
        content["ratio_index"]["roll_lever_m"] = 0.0
    if content["cross_spectrum"] is not None:
        places = {"sensor_left_m": vehicle["sensor_offset_left_m"], "sensor_left_std_m": offset_std_m}
        content["cross_spectrum"] |= {"track_width_m": None, "cg_left_inflation": 1.0, **places}
    for run in content["provenance"]["runs"]:
        run["payload_left_m"] = None


def _to_version_4(content: Content) -> None:
    """Version 4 says what was inherited from a line. Before, there were no lines."""
    content["line"] = None


def _to_version_5(content: Content) -> None:
    """Version 5 says how long loads usually lie. Before, nobody was asked."""
    content["vehicle"]["payload_length_m"] = None
    if content["cross_spectrum"] is not None:
        content["cross_spectrum"]["payload_length_m"] = None


def _to_version_6(content: Content) -> None:
    """Version 6 says how much slack the model has at least. Before, it was one percent with a roll rate too."""
    if content["cross_spectrum"] is not None:
        content["cross_spectrum"]["least_slack"] = 0.01


def _to_version_7(content: Content) -> None:
    """Version 7 says how fast each axle's springs usually move. Before, friction went by how much the body moves."""
    if content["cross_spectrum"] is not None:
        content["cross_spectrum"]["usual_stroke_mps"] = None
    if content["line"] is not None:
        content["line"]["usual_stroke_mps"] = None


# Entry v turns version v into v + 1. Entries are never edited, only added.
MIGRATIONS: Final[Mapping[int, Callable[[Content], None]]] = MappingProxyType(
    {1: _to_version_2, 2: _to_version_3, 3: _to_version_4, 4: _to_version_5, 5: _to_version_6, 6: _to_version_7}
)


def migrated(content: Content, version: int) -> Content:
    """``content`` as ``version`` has it, with the id it had in ``migrated_from``; the same object where it is that.

    ``content["version"]`` must lie between FIRST_VERSION and ``version``. Raises KeyError, TypeError or
    AttributeError where the content has not the shape of its version.
    """
    if content["version"] == version:
        return content
    current = copy.deepcopy(content)
    current["migrated_from"] = content.get("migrated_from") or content["id"]
    for step in range(content["version"], version):
        MIGRATIONS[step](current)
        current["version"] = step + 1
    return current
