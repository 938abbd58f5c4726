"""The calibration file. Written by the tool, never by hand."""

from pathlib import Path
from typing import ClassVar, Final, Literal, Self

from pydantic import Field, model_validator

from gateway.calibration.file.hashed import FileWords, HashedFile, checked_file, read_content
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
from gateway.toml_file import Read

FORMAT: Final = "springscale-calibration"
VERSION: Final = 11  # of the format


class CalibrationFile(HashedFile):
    """The whole file except its id."""

    words: ClassVar[FileWords] = FileWords("calibration file", "calibrate again", "springscale calibrate")
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


def load_calibration(path: Path | str, read: Read = Path.read_bytes) -> CalibrationFile:
    """Reads; checks version, hash and shape.

    Raises CalibrationFileError saying what to do.
    """
    path = Path(path)
    held = checked_file(path, read_content(path, read), CalibrationFile)
    try:
        held.require_known()
        if (fault := absurd(held)) is not None:
            raise CalibrationFileError(fault)
    except CalibrationFileError as fault:
        raise CalibrationFileError(f"{path}: {fault}") from None
    return held
