"""The calibration file: versioned JSON whose id is the hash of its content. Written by the tool, never by hand."""

import hashlib
import json
from pathlib import Path
from typing import Any, Final, Literal, Self

from pydantic import Field, ValidationError, model_validator

from gateway.calibration.file.parts import ExpectedErrorsPart, LinePart, ProvenancePart, SeenPart
from gateway.calibration.file.sane import absurd
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, ROLL_PARAMETERS
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.core.ratio_index.regression import TERMS
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationFileError, UntrustedFileError
from gateway.files.signed import Read
from gateway.schema import check_shapes
from gateway.stated.facts import Part
from gateway.toml_file import describe_faults

Content = dict[str, Any]
FORMAT: Final = "springscale-calibration"
VERSION: Final = 10  # of the format


class CalibrationFile(Part):
    """The whole file except its id."""

    format: Literal["springscale-calibration"] = FORMAT
    version: Literal[10] = VERSION
    vehicle: Vehicle
    seen: SeenPart
    cross_spectrum: CrossSpectrumCalibration | None = None
    ratio_index: RatioIndexCalibration | None = None
    line: LinePart | None = Field(
        None, description="prior from vehicles of the same line; null: its own drives are the only data"
    )
    expected_errors: dict[str, ExpectedErrorsPart] = Field(
        default_factory=dict, description="by estimator: errors on runs left out of the fit"
    )
    warnings: tuple[str, ...] = ()
    provenance: ProvenancePart

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

    @property
    def id(self) -> str:
        """sha256 of the canonical JSON of everything in the file but the id itself; estimates name it."""
        return content_id(self.model_dump(mode="json"))

    def to_json(self) -> str:
        """The file's text, id first."""
        content = {"id": self.id, **self.model_dump(mode="json")}
        return json.dumps(content, indent=1, allow_nan=False) + "\n"

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
        if self.line is not None:
            self.line.require_known()

    @property
    def estimators(self) -> tuple[str, ...]:
        """Estimators that this file has a calibration for; the service runs the first by default."""
        held = {"cross_spectrum": self.cross_spectrum, "ratio_index": self.ratio_index}
        return tuple(name for name, part in held.items() if part is not None)


def content_id(content: dict[str, Any]) -> str:
    """sha256:... over the canonical JSON of ``content`` (keys sorted, no spaces), its own id left out."""
    rest = {key: part for key, part in content.items() if key != "id"}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return "sha256:" + hashlib.sha256(text.encode()).hexdigest()


def load_calibration(path: Path | str, read: Read = Path.read_bytes) -> CalibrationFile:
    """Reads; checks version, hash and shape.

    ``read`` checks the signature if one is required (files.signed).

    Raises CalibrationFileError saying what to do.
    """
    path = Path(path)
    content = read_content(path, read)
    if content.get("format") != FORMAT:
        raise CalibrationFileError(f"{path}: not a springscale calibration file (format is {content.get('format')!r})")
    if content.get("version") != VERSION:
        raise CalibrationFileError(
            f"{path}: calibration file version {content.get('version')!r}, this springscale reads version {VERSION}: "
            "calibrate again with `springscale calibrate`"
        )
    if not matches_its_id(content):
        raise CalibrationFileError(
            f"{path}: content does not match its id: the file was changed after it was written; "
            "restore it or calibrate again"
        )
    try:
        held = CalibrationFile.model_validate({key: part for key, part in content.items() if key != "id"})
        held.require_known()
        if (fault := absurd(held)) is not None:
            raise CalibrationFileError(fault)
    except CalibrationFileError as fault:
        raise CalibrationFileError(f"{path}: {fault}") from None
    except ValidationError as fault:
        raise CalibrationFileError(describe_faults(path, fault, CalibrationFile)) from None
    return held


def matches_its_id(content: Content) -> bool:
    """False for a file that was changed since it was written."""
    try:
        return bool(content.get("id") == content_id(content))
    except ValueError:  # a number that is not finite, which is never written
        return False


def read_content(path: Path, read: Read) -> Content:
    """A file's JSON object. Raises CalibrationFileError if it is none."""
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
