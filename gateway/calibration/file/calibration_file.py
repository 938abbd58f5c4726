"""The calibration file. Written by the tool, never by hand."""

import hashlib
import json
from pathlib import Path
from typing import Any, Final, Literal, Self

from pydantic import Field, PrivateAttr, ValidationError, model_validator

from gateway.calibration.file.parts import ExpectedErrorsPart, ProvenancePart, SeenPart
from gateway.calibration.file.sane import absurd
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.core.ratio_index.regression import TERMS
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationFileError
from gateway.model.table import NAMES, N
from gateway.model.vehicle import VehicleModel
from gateway.schema import check_shapes
from gateway.stated.facts import Part
from gateway.toml_file import Read, describe_faults
from gateway.weighing.calibrated import CalibratedVehicle

FORMAT: Final = "springscale-calibration"
VERSION: Final = 1  # of the format
TABLE: Final = hashlib.sha256("\n".join(NAMES).encode()).hexdigest()[:16]
"""The version of the table of parameters: a hash of their names."""

Content = dict[str, Any]


class CalibrationFile(Part):
    """The whole file. Its id is the hash of its bytes, so the file does not contain it."""

    format: Literal["springscale-calibration"] = FORMAT
    version: Literal[1] = VERSION
    table: str = Field(TABLE, description="version of the table of parameters that cross_spectrum follows")
    vehicle: Vehicle
    seen: SeenPart
    cross_spectrum: VehicleModel | None = Field(None, description="the posterior of the vehicle's parameters")
    ratio_index: RatioIndexCalibration | None = None
    sister_id: str | None = Field(
        None, description="of the calibration that gave the prior; null: the prior is that of any vehicle"
    )
    expected_errors: dict[str, ExpectedErrorsPart] = Field(
        default_factory=dict, description="by estimator: errors on drives left out of the fit"
    )
    warnings: tuple[str, ...] = ()
    provenance: ProvenancePart
    _text: str | None = PrivateAttr(None)

    @property
    def id(self) -> str:
        """sha256 of the file's bytes; estimates name it."""
        return "sha256:" + hashlib.sha256(self.to_json().encode()).hexdigest()

    def to_json(self) -> str:
        """The file's text: what was read, if it was."""
        return self._text or json.dumps(self.model_dump(mode="json"), indent=1, allow_nan=False) + "\n"

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        known = self.cross_spectrum
        if known is not None:
            if not known.taught_loads:
                raise ValueError("cross_spectrum.taught_loads is empty: no drive taught this vehicle")
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
        if self.cross_spectrum and (self.table != TABLE or self.cross_spectrum.names not in (NAMES[:N], NAMES)):
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


def load_calibration(path: Path | str, read: Read = Path.read_bytes) -> CalibrationFile:
    """Reads; checks format, version, shapes and bounds. Raises CalibrationFileError saying what to do."""
    path = Path(path)
    text = _text_of(path, read)
    try:
        held = CalibrationFile.model_validate(_checked(path, text))
        held.require_known()
        if (fault := absurd(held)) is not None:
            raise CalibrationFileError(fault)
    except CalibrationFileError as fault:
        raise CalibrationFileError(f"{path}: {str(fault).removeprefix(f'{path}: ')}") from None
    except ValidationError as fault:
        raise CalibrationFileError(describe_faults(path, fault, CalibrationFile)) from None
    held._text = text
    return held


def _text_of(path: Path, read: Read) -> str:
    try:
        return read(path).decode("utf-8")
    except FileNotFoundError:
        raise CalibrationFileError(f"{path}: no such calibration file") from None
    except (OSError, UnicodeDecodeError) as fault:
        raise CalibrationFileError(f"{path}: cannot be read: {fault}") from None


def _checked(path: Path, text: str) -> Content:
    """The file's JSON object, if its format and version are right."""
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as fault:  # a number of 5000 digits and brackets 5000 deep are no JSON for us
        raise CalibrationFileError(
            f"{path}: not valid JSON: {fault}: the file is damaged or was cut short; restore it or calibrate again"
        ) from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise CalibrationFileError(f"{path}: not a springscale calibration file")
    if content.get("version") != VERSION:
        raise CalibrationFileError(
            f"{path}: calibration file version {content.get('version')!r}, this springscale reads version {VERSION}: "
            "calibrate again with `springscale calibrate`"
        )
    return content
