"""The vehicle calibration file: JSON whose id is the hash of its bytes. The tool writes it, never a hand.

The estimators' results come in; the calibrations for the core go out (``CalibrationFile.for_core``). Vehicle and
estimators are the core's own records. A file is checked whole when it is read: its hash only proves that its numbers
are unchanged, so a table says what is plausible for a vehicle.
"""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Literal, Self

import numpy as np
from pydantic import Field, PrivateAttr, ValidationError, model_validator

from gateway.calibration.statements import Statement
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.core.ratio_index.regression import TERMS
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationFileError
from gateway.files.toml_file import Read, describe_faults
from gateway.metadata import check_shapes
from gateway.model.table import NAMES, N
from gateway.model.vehicle_model import VehicleModel
from gateway.stated.facts import Part
from gateway.weighing.calibrated import CalibratedVehicle

FORMAT: Final = "springscale-calibration"
VERSION: Final = 1  # of the format
TABLE: Final = hashlib.sha256("\n".join(NAMES).encode()).hexdigest()[:16]
"""The version of the table of parameters: a hash of their names."""
LEAST_EIGENVALUE: Final = 1e-12  # of a covariance scaled to ones on its diagonal; less is singular in double precision


class SeenPart(Part):
    """The ranges that the drives covered, and those of its sister: the ranges of validity."""

    payload_kg: tuple[float, float]
    front_share_pct: tuple[float, float]
    speed_mps: tuple[float, float]
    sensor_rate_hz: tuple[float, float] | None = Field(
        description="lower sending rate of accelerometer and gyro; null: not known"
    )
    roughness_mps2: tuple[float, float] | None = Field(
        description="of the roads: vertical acceleration, root mean square from 1 to 15 Hz, scaled to 80 km/h"
    )


class FoundPart(Part):
    """What the fit found of a drive's load, and what the drive says without its statement."""

    payload_kg: float
    payload_std_kg: float
    front_share_pct: float
    without_statement_kg: float | None = Field(description="null: nothing was stated of the payload")
    without_statement_std_kg: float | None
    is_held: bool = Field(description="the statement disagrees beyond chance with its drive, and taught nothing")


class DrivePart(Part):
    """One drive that taught the vehicle: where its numbers come from, what was stated of it, what was found."""

    number: int
    log: str
    sha256: str
    t_start: str | None = Field(None, description="of the piece of the log that was used; null: not known")
    t_end: str | None = None
    n_batches: int
    statement: Statement
    found: FoundPart | None = Field(description="null: cross_spectrum was not fitted to this drive")


class ProvenancePart(Part):
    """Enough to repeat the calibration."""

    software: str
    command: str
    campaign_sha256: str
    drives: tuple[DrivePart, ...]


class ExpectedErrorsPart(Part):
    """Errors on drives left out of the fit, over the identification part (root mean square)."""

    payload_rms_kg: float | None
    front_share_rms_pct: float | None


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
            for name in ("empty_mass_kg", "empty_front_share_pct", "wheelbase_m", "track_width_m"):
                of_fit, of_vehicle = getattr(known, name), getattr(self.vehicle, name)
                if of_fit != of_vehicle:
                    raise ValueError(
                        f"vehicle.{name} is {of_vehicle}, but the springs were fitted with {of_fit}: restore the "
                        "file, or calibrate again with the right figure"
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
        return tuple(name for name in ("cross_spectrum", "ratio_index") if getattr(self, name) is not None)


def load_calibration(path: Path | str, read: Read = Path.read_bytes) -> CalibrationFile:
    """Reads; checks format, version, shapes and bounds. Raises CalibrationFileError saying what to do."""
    path = Path(path)
    try:
        text = read(path).decode("utf-8")
    except FileNotFoundError:
        raise CalibrationFileError(f"{path}: no such calibration file") from None
    except OSError as fault:
        raise CalibrationFileError(f"{path}: cannot be read: {fault.strerror or fault}") from None
    except UnicodeDecodeError as fault:
        raise CalibrationFileError(f"{path}: cannot be read: {fault}") from None
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
    try:
        held = CalibrationFile.model_validate(content)
        held.require_known()
    except ValidationError as fault:
        raise CalibrationFileError(describe_faults(path, fault, CalibrationFile)) from None
    except CalibrationFileError as fault:
        raise CalibrationFileError(f"{path}: {fault}") from None
    if (absurd := _absurd(held)) is not None:
        raise CalibrationFileError(f"{path}: {absurd}")
    held._text = text
    return held


def _between(low: float, high: float) -> Callable[[Any], bool]:
    return lambda x: bool(np.all(np.asarray(x) > low) and np.all(np.asarray(x) < high))


def _rising(low: float, high: float) -> Callable[[Any], bool]:
    """Pairs of a lower and a higher number, both between these."""
    return lambda pair: low <= pair[0] <= pair[1] <= high


def _is_covariance(matrix: Any) -> bool:
    """Symmetric and positive definite, by its correlations: units differ by many powers of ten."""
    std = np.sqrt(np.diag(matrix))
    if not (np.all(np.isfinite(std)) and np.all(std > 0.0)):
        return False
    scaled = matrix / np.outer(std, std)
    return bool(np.allclose(scaled, scaled.T, atol=1e-6) and np.linalg.eigvalsh(scaled)[0] > LEAST_EIGENVALUE)


def _is_gram_inverse(matrix: Any) -> bool:
    """Symmetric and positive semidefinite: a regression through loads it knew exactly has zeros."""
    least = 1e-6 * float(np.abs(matrix).max())
    return bool(np.allclose(matrix, matrix.T, atol=least) and np.linalg.eigvalsh(matrix)[0] >= -least)


_SPEEDS: Final = ("two speeds above 0 and below 100 m/s, the lower first", _rising(1e-3, 100.0))
_SHARES: Final = ("two shares between 0 and 100 %, the lower first", _rising(0.0, 100.0))
_LOADS: Final = ("two loads within 100 t, the lower first", _rising(-1e5, 1e5))
_BANDS: Final = (
    "centres and widths above 0 Hz",
    lambda pair: all(0.0 < centre < 50.0 and 0.0 < width <= 2.0 * centre for centre, width in pair),
)
_GRAM_INVERSE: Final = ("symmetric and positive semidefinite", _is_gram_inverse)

BOUNDS: Final[dict[str, tuple[str, Callable[[Any], bool]]]] = {
    "seen.payload_kg": _LOADS,
    "seen.front_share_pct": _SHARES,
    "seen.speed_mps": _SPEEDS,
    "cross_spectrum.empty_mass_kg": ("between 10 kg and 100 t", _between(10.0, 1e5)),
    "cross_spectrum.wheelbase_m": ("between 0.3 and 20 m", _between(0.3, 20.0)),
    "cross_spectrum.empty_front_share_pct": ("between 0 and 100 %", _between(0.0, 100.0)),
    "cross_spectrum.band_hz": (
        "two frequencies up to 100 Hz, rising",
        lambda pair: 1e-3 <= pair[0] < pair[1] <= 100.0,
    ),
    "cross_spectrum.parameters": ("within +-50", _between(-50.0, 50.0)),
    "cross_spectrum.covariance": ("symmetric and positive definite", _is_covariance),
    "cross_spectrum.spread": ("between 0.1 and 10", _between(0.1, 10.0)),
    "cross_spectrum.usual_log_amplitude": ("within +-50", _between(-50.0, 50.0)),
    "cross_spectrum.payload_seen_kg": _LOADS,
    "cross_spectrum.front_share_seen_pct": _SHARES,
    "cross_spectrum.speed_seen_mps": _SPEEDS,
    "ratio_index.acceleration_bands": _BANDS,
    "ratio_index.pitch_rate_bands": _BANDS,
    "ratio_index.speed_range_mps": _SPEEDS,
    "ratio_index.payload.gram_inverse": _GRAM_INVERSE,
    "ratio_index.front_share.gram_inverse": _GRAM_INVERSE,
}
"""Fields by their path in the file, each with what it must be and the test of that."""


def _absurd(file: CalibrationFile) -> str | None:
    """The first field whose number is impossible for a vehicle, its value and its condition; None if all are sound.

    A field that is absent from this file, or null, is not checked.
    """
    with np.errstate(all="ignore"):
        for path, (must_be, holds) in BOUNDS.items():
            known: Any = file
            for name in path.split("."):
                known = getattr(known, name, None)
            if known is not None and not holds(known):
                array = np.asarray(known)
                shown = f"an array of {' x '.join(map(str, array.shape))}" if array.size > 4 else str(array.tolist())
                return f"{path} is {shown}: it must be {must_be}; calibrate again"
    return None
