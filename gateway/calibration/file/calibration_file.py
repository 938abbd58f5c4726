"""The calibration file. Written by the tool, never by hand."""

import hashlib
import json
from pathlib import Path
from typing import Any, Final, Literal, Self

from pydantic import Field, PrivateAttr, ValidationError, model_validator

from gateway.calibration.file.parts import ExpectedErrorsPart, ProvenancePart, SeenPart
from gateway.calibration.file.sane import absurd
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, ROLL_PARAMETERS
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.core.ratio_index.regression import TERMS
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationFileError
from gateway.schema import check_shapes
from gateway.stated.facts import Part
from gateway.toml_file import Read, describe_faults

FORMAT: Final = "springscale-calibration"
VERSION: Final = 11  # of the format


Content = dict[str, Any]


class CalibrationFile(Part):
    """The whole file except its id."""

    format: Literal["springscale-calibration"] = FORMAT
    version: Literal[11] = VERSION
    vehicle: Vehicle
    seen: SeenPart
    cross_spectrum: CrossSpectrumCalibration | None = None
    ratio_index: RatioIndexCalibration | None = None
    sister_id: str | None = Field(
        None, description="of the calibration that gave the prior; null: its own drives are the only data"
    )
    expected_errors: dict[str, ExpectedErrorsPart] = Field(
        default_factory=dict, description="by estimator: errors on runs left out of the fit"
    )
    warnings: tuple[str, ...] = ()
    provenance: ProvenancePart
    _stored: Content | None = PrivateAttr(None)  # what was read: today's fields may be more

    @property
    def id(self) -> str:
        """sha256 of the canonical JSON of everything in the file but the id itself; estimates name it."""
        return content_id(self._content)

    def to_json(self) -> str:
        """The file's text, id first: what was read, if it was."""
        return json.dumps({"id": self.id, **self._content}, indent=1, allow_nan=False) + "\n"

    @property
    def _content(self) -> Content:
        return self._stored or self.model_dump(mode="json")

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        known = self.cross_spectrum
        if known is not None:
            n = len(known.names)
            check_shapes(
                parameters=(known.parameters, (n,)),
                covariance=(known.covariance, (n, n)),
                directions=(known.directions, (n, known.directions.shape[-1])),
            )
        return self

    def for_core(self) -> CalibratedVehicle:
        """The calibrations that the estimators need. Raises as :meth:`require_known` does."""
        self.require_known()
        return CalibratedVehicle(
            id=self.id,
            vehicle=self.vehicle,
            payload_seen_kg=self.seen.payload_kg,
            front_share_seen_pct=self.seen.front_share_pct,
            ratio_index=self.ratio_index,
            cross_spectrum=self.cross_spectrum,
            sensor_rate_seen_hz=self.seen.sensor_rate_hz,
        )

    def require_known(self) -> None:
        """Raises CalibrationFileError if today's model has other parameters, or a regression other terms."""
        if self.cross_spectrum and self.cross_spectrum.names not in (PARAMETERS, PARAMETERS + ROLL_PARAMETERS):
            raise CalibrationFileError(
                "the cross_spectrum part was fitted with another vehicle model than this springscale has: "
                "calibrate again"
            )
        regressions = (self.ratio_index.payload, self.ratio_index.front_share) if self.ratio_index else ()
        unknown = sorted({term for one in regressions if one for term in one.terms} - set(TERMS))
        if unknown:
            raise CalibrationFileError(f"regression terms {unknown} are not known to this version of springscale")

    @property
    def estimators(self) -> tuple[str, ...]:
        """Estimators that this file has a calibration for; the service runs the first by default."""
        held = {"cross_spectrum": self.cross_spectrum, "ratio_index": self.ratio_index}
        return tuple(name for name, part in held.items() if part is not None)


def content_id(content: Content) -> str:
    """sha256:... over the canonical JSON of ``content`` (keys sorted, no spaces), its own id left out."""
    rest = {key: part for key, part in content.items() if key != "id"}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return "sha256:" + hashlib.sha256(text.encode()).hexdigest()


def load_calibration(path: Path | str, read: Read = Path.read_bytes) -> CalibrationFile:
    """Reads; checks version, hash and shape. Raises CalibrationFileError saying what to do."""
    path = Path(path)
    content = _checked(path, _content_of(path, read))
    del content["id"]
    try:
        held = CalibrationFile.model_validate(content)
        held.require_known()
        if (fault := absurd(held)) is not None:
            raise CalibrationFileError(fault)
    except CalibrationFileError as fault:
        raise CalibrationFileError(f"{path}: {fault}") from None
    except ValidationError as fault:
        raise CalibrationFileError(describe_faults(path, fault, CalibrationFile)) from None
    held._stored = content
    return held


def _checked(path: Path, content: Content) -> Content:
    """The content, if its format, version and hash are right."""
    if content.get("format") != FORMAT:
        raise CalibrationFileError(f"{path}: not a springscale calibration file (format is {content.get('format')!r})")
    if content.get("version") != VERSION:
        raise CalibrationFileError(
            f"{path}: calibration file version {content.get('version')!r}, this springscale reads version {VERSION}: "
            "calibrate again with `springscale calibrate`"
        )
    if not _matches_its_id(content):
        raise CalibrationFileError(
            f"{path}: content does not match its id: the file was changed after it was written; restore it or "
            "calibrate again"
        )
    return content


def _matches_its_id(content: Content) -> bool:
    """False for a file that was changed since it was written."""
    try:
        return bool(content.get("id") == content_id(content))
    except ValueError:  # a number that is not finite, which is never written
        return False


def _content_of(path: Path, read: Read) -> Content:
    """A file's JSON object. Raises CalibrationFileError if it is none."""
    try:
        content = json.loads(read(path).decode("utf-8"))
    except FileNotFoundError:
        raise CalibrationFileError(f"{path}: no such calibration file") from None
    except (OSError, UnicodeDecodeError) as fault:
        raise CalibrationFileError(f"{path}: cannot be read: {fault}") from None
    except (ValueError, RecursionError) as fault:  # a number of 5000 digits and brackets 5000 deep are no JSON for us
        raise CalibrationFileError(f"{path}: not valid JSON: {fault}") from None
    if not isinstance(content, dict):
        raise CalibrationFileError(f"{path}: not a springscale calibration file")
    return content
