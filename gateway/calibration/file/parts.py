"""The parts of the calibration file: what each table of the JSON holds, and the same in the core's terms."""

from dataclasses import astuple, fields
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    NonNegativeFloat,
    PlainSerializer,
    PositiveFloat,
    WithJsonSchema,
    model_validator,
)

from gateway.core.cargo import Carries
from gateway.core.cross_spectrum.calibration import SCORE, CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import LEAST_SLACK, PARAMETERS, ROLL_PARAMETERS
from gateway.core.ratio_index.index import Band, RatioIndexCalibration
from gateway.core.ratio_index.regression import TERMS, RegressionModel
from gateway.core.vehicle import UNKNOWN_OFFSET_STD_M, Load
from gateway.errors import CalibrationFileError
from gateway.records import F64


def _array(numbers: Any) -> F64:
    try:
        array = np.asarray(numbers, dtype=float)
    except (OverflowError, TypeError, ValueError):
        raise ValueError("is no array of numbers") from None
    if array.ndim == 0:
        raise ValueError("is one number where an array belongs")
    if not np.all(np.isfinite(array)):
        raise ValueError("holds a number that is not finite")
    return array


def check_shapes(**expected: tuple[F64, tuple[int, ...]]) -> None:
    """Arrays by name, each with the shape it must have. Raises ValueError."""
    for name, (array, shape) in expected.items():
        if array.shape != shape:
            raise ValueError(f"{name} has the shape {array.shape}, its terms or names ask for {shape}")


Array = Annotated[
    F64,
    BeforeValidator(_array),
    PlainSerializer(lambda x: x.tolist(), return_type=list[Any]),
    WithJsonSchema({"type": "array", "items": {"anyOf": [{"type": "number"}, {"type": "array"}]}}),
]


class Part(BaseModel):
    """A table of the file: unchangeable, and an unknown key is an error."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        arbitrary_types_allowed=True,
        json_schema_serialization_defaults_required=True,  # the tool writes every key
    )


class RegressionPart(Part):
    """One regression (9), (10) or (11); see core.regression.RegressionModel."""

    terms: tuple[str, ...]
    lows: Array
    highs: Array
    coefficients: Array
    gram_inverse: Array
    residual_std: float = Field(gt=0.0)
    dof: float = Field(gt=0.0)

    @model_validator(mode="after")
    def _is_consistent(self) -> "RegressionPart":
        n = len(self.terms)
        check_shapes(
            lows=(self.lows, (n,)),
            highs=(self.highs, (n,)),
            coefficients=(self.coefficients, (n + 1,)),
            gram_inverse=(self.gram_inverse, (n + 1, n + 1)),
        )
        return self

    def for_core(self) -> RegressionModel:
        """The same in the core's terms. Raises CalibrationFileError for a term this version does not know."""
        unknown = sorted(set(self.terms) - set(TERMS))
        if unknown:
            raise CalibrationFileError(f"regression terms {unknown} are not known to this version of springscale")
        return RegressionModel(**dict(self))


class RatioIndexPart(Part):
    """The ratio index of this vehicle; bands are [centre Hz, width Hz], numerator first."""

    spectrum: Literal["amplitude", "power"]
    n_segment: int = Field(ge=64, le=65_536)
    acceleration_bands: tuple[tuple[float, float], tuple[float, float]] | None
    pitch_rate_bands: tuple[tuple[float, float], tuple[float, float]] | None
    payload: RegressionPart | None
    front_share: RegressionPart | None
    speed_range_mps: tuple[float, float]
    speed_std_max_mps: float = Field(gt=0.0)
    roll_lever_m: float = Field(
        description="the sensor's place left of the centre line, from where the roll rate moves the acceleration to "
        "that line; 0: the acceleration is taken as measured"
    )

    @classmethod
    def of(cls, calibration: RatioIndexCalibration) -> "RatioIndexPart":
        """The core's calibration as the file holds it."""
        return cls(
            spectrum=calibration.spectrum,
            n_segment=calibration.n_segment,
            acceleration_bands=_from_bands(calibration.acceleration_bands),
            pitch_rate_bands=_from_bands(calibration.pitch_rate_bands),
            payload=_regression_part(calibration.payload),
            front_share=_regression_part(calibration.front_share),
            speed_range_mps=calibration.speed_range_mps,
            speed_std_max_mps=calibration.speed_std_max_mps,
            roll_lever_m=calibration.roll_lever_m,
        )

    def for_core(self) -> RatioIndexCalibration:
        """The same in the core's terms."""
        return RatioIndexCalibration(
            spectrum=self.spectrum,
            n_segment=self.n_segment,
            acceleration_bands=_to_bands(self.acceleration_bands),
            pitch_rate_bands=_to_bands(self.pitch_rate_bands),
            payload=self.payload.for_core() if self.payload else None,
            front_share=self.front_share.for_core() if self.front_share else None,
            speed_range_mps=self.speed_range_mps,
            speed_std_max_mps=self.speed_std_max_mps,
            roll_lever_m=self.roll_lever_m,
        )


def _from_bands(bands: tuple[Band, Band] | None) -> tuple[tuple[float, float], tuple[float, float]] | None:
    if bands is None:
        return None
    return (bands[0].centre_hz, bands[0].width_hz), (bands[1].centre_hz, bands[1].width_hz)


def _to_bands(bands: tuple[tuple[float, float], tuple[float, float]] | None) -> tuple[Band, Band] | None:
    return None if bands is None else (Band(*bands[0]), Band(*bands[1]))


def _regression_part(model: RegressionModel | None) -> RegressionPart | None:
    if model is None:
        return None
    return RegressionPart(**{name: getattr(model, name) for name in RegressionPart.model_fields})


class CrossSpectrumPart(Part):
    """The half-car of this vehicle; see core.cross_spectrum.CrossSpectrumCalibration."""

    empty_mass_kg: float = Field(gt=0.0)
    empty_front_share_pct: float
    wheelbase_m: float = Field(gt=0.0)
    band_hz: tuple[float, float]
    n_segment: int = Field(ge=64, le=65_536)
    names: tuple[str, ...]
    parameters: Array
    covariance: Array
    directions: Array
    model_std: tuple[NonNegativeFloat, NonNegativeFloat, NonNegativeFloat]
    misfit_limit: float = Field(gt=0.0)
    acceleration_rms_mps2: float = Field(gt=0.0)
    pitch_rate_rms_radps: float = Field(gt=0.0)
    payload_seen_kg: tuple[float, float]
    front_share_seen_pct: tuple[float, float]
    speed_seen_mps: tuple[float, float]
    warnings: tuple[str, ...] = ()
    version: int = 1  # of this part; there has been one
    known_loads: tuple[tuple[float, float], ...] = ()
    model_per_reach: tuple[NonNegativeFloat, NonNegativeFloat] = (0.0, 0.0)
    usual_log_amplitude: float | None = None
    gravity_mps2: float | None = Field(None, gt=0.0)
    most_position_score: float = Field(SCORE, gt=0.0)
    most_noise_score: float = Field(SCORE, gt=0.0)
    track_width_m: float | None = Field(None, gt=0.0)
    sensor_left_m: float = 0.0
    sensor_left_std_m: float = Field(UNKNOWN_OFFSET_STD_M, gt=0.0)
    least_slack: float = Field(LEAST_SLACK, gt=0.0)
    usual_stroke_mps: tuple[PositiveFloat, PositiveFloat] | None = None

    @model_validator(mode="after")
    def _is_consistent(self) -> "CrossSpectrumPart":
        n = len(self.names)
        k = self.directions.shape[-1]
        check_shapes(
            parameters=(self.parameters, (n,)),
            covariance=(self.covariance, (n, n)),
            directions=(self.directions, (n, k)),
        )
        return self

    @classmethod
    def of(cls, calibration: CrossSpectrumCalibration) -> "CrossSpectrumPart":
        """The core's calibration as the file holds it."""
        known = {one.name: getattr(calibration, one.name) for one in fields(calibration)}
        return cls(**known | {"known_loads": tuple(astuple(load) for load in calibration.known_loads)})

    def for_core(self) -> CrossSpectrumCalibration:
        """The same in the core's terms. Raises CalibrationFileError where the model has other parameters today."""
        if self.names not in (PARAMETERS, PARAMETERS + ROLL_PARAMETERS):
            raise CalibrationFileError(
                "the cross_spectrum part was fitted with another vehicle model than this springscale has: "
                "calibrate again"
            )
        known = {one.name: getattr(self, one.name) for one in fields(CrossSpectrumCalibration)}
        return CrossSpectrumCalibration(**known | {"known_loads": tuple(Load(*load) for load in self.known_loads)})


class VehiclePart(Part):
    """The vehicle as the campaign stated it."""

    name: str
    empty_mass_kg: float = Field(gt=0.0)
    wheelbase_m: float = Field(gt=0.0)
    empty_front_share_pct: float
    sensor_position_m: float
    payload_range_kg: tuple[float, float]
    front_share_range_pct: tuple[float, float]
    sensor_position_std_m: float
    empty_front_share_std_pct: float
    sensor_offset_left_m: float
    sensor_offset_left_std_m: float
    track_width_m: float | None
    empty_cg_left_m: float
    unsprung_front_kg: float | None
    unsprung_rear_kg: float | None
    kerb_front_axle_kg: float | None
    kerb_rear_axle_kg: float | None
    wheel_radius_m: float | None
    front_axle_limit_kg: float | None
    rear_axle_limit_kg: float | None
    gross_limit_kg: float | None
    front_wheel_limit_kg: float | None
    rear_wheel_limit_kg: float | None
    payload_length_m: float | None = Field(None, gt=0.0)
    payload_height_m: float | None = Field(None, gt=0.0)
    carries: Carries | None = None
    roof_rack: bool = False
    tow_bar: bool = False


class SeenPart(Part):
    """What the identification runs covered, and those of its line: the ranges of validity."""

    payload_kg: tuple[float, float]
    front_share_pct: tuple[float, float]
    speed_mps: tuple[float, float]
    roughness_mps2: tuple[float, float] | None = Field(
        description="of the roads: vertical acceleration, root mean square from 1 to 15 Hz, brought to 80 km/h"
    )


class RunPart(Part):
    """One known-load drive: where its numbers come from."""

    number: int
    log: str
    sha256: str
    payload_kg: float
    front_share_pct: float
    payload_left_m: float | None = Field(description="left of the vehicle's centre line; null: not noted")
    n_batches: int


class ProvenancePart(Part):
    """Enough to repeat the calibration."""

    software: str
    command: str
    campaign_sha256: str
    runs: tuple[RunPart, ...]


class ExpectedErrorsPart(Part):
    """Errors on runs left out of the fit, over the identification part (root mean square)."""

    payload_rms_kg: float | None
    front_share_rms_pct: float | None
