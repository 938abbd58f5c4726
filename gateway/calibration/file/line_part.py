"""What a calibration inherited from sister vehicles, as the file holds it; a line file holds the same."""

from dataclasses import asdict, astuple
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from gateway.calibration.file.parts import Array, Part, check_shapes
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS, ROLL_PARAMETERS
from gateway.core.vehicle import Load
from gateway.errors import CalibrationFileError
from gateway.records import F64

if TYPE_CHECKING:
    from gateway.calibration.line import Evidence, Line


class EvidencePart(Part):
    """What members' drives say of the line's mean: the inverse of a covariance, and that times the mean."""

    names: tuple[str, ...]
    information: Array
    pull: Array

    @model_validator(mode="after")
    def _is_consistent(self) -> "EvidencePart":
        n = len(self.names)
        check_shapes(information=(self.information, (n, n)), pull=(self.pull, (n,)))
        if not np.array_equal(self.information, self.information.T):
            raise ValueError("information is not symmetric")
        return self

    @classmethod
    def of(cls, evidence: "Evidence", names: tuple[str, ...]) -> "EvidencePart":
        """Of those ``names`` (n,) of which something is known."""
        told = np.flatnonzero(np.any(evidence.information != 0.0, axis=1))
        held = evidence.information[np.ix_(told, told)]
        return cls(names=tuple(names[i] for i in told), information=held, pull=evidence.pull[told])

    def require_known(self, names: tuple[str, ...]) -> None:
        """Raises CalibrationFileError for a parameter that this version does not have."""
        unknown = sorted(set(self.names) - set(names))
        if unknown:
            raise CalibrationFileError(
                f"the line was built with another vehicle model than this springscale has ({', '.join(unknown)}): "
                "calibrate its vehicles again"
            )

    def for_core(self, names: tuple[str, ...]) -> "Evidence":
        """Of all ``names`` (n,). Raises as :meth:`require_known` does."""
        from gateway.calibration.line import Evidence  # noqa: PLC0415 # a service reads, and loads nothing that fits

        self.require_known(names)
        at = [names.index(name) for name in self.names]
        evidence = Evidence.none(len(names))
        evidence.information[np.ix_(at, at)] = self.information
        evidence.pull[at] = self.pull
        return evidence


class LimitsPart(Part):
    """What runs or siblings left out showed; see CrossSpectrumPart."""

    model_std: tuple[NonNegativeFloat, NonNegativeFloat, NonNegativeFloat]
    model_per_reach: tuple[NonNegativeFloat, NonNegativeFloat]
    misfit_limit: float = Field(gt=0.0)
    most_position_score: float = Field(gt=0.0)
    most_noise_score: float = Field(gt=0.0)


class LineSeenPart(Part):
    """Over which loads, speeds and roads the members were driven; see CrossSpectrumPart."""

    payload_seen_kg: tuple[float, float]
    front_share_seen_pct: tuple[float, float]
    speed_seen_mps: tuple[float, float]
    acceleration_rms_mps2: float = Field(gt=0.0)
    pitch_rate_rms_radps: float = Field(gt=0.0)
    known_loads: tuple[tuple[float, float], ...]


class LinePart(Part):
    """What the calibrations of several vehicles tell of the next one of their line; see calibration.line.Line."""

    members: tuple[str, ...] = Field(min_length=1, description="ids of the calibrations it was made of")
    wheelbase_m: float = Field(gt=0.0)
    empty_mass_kg: float = Field(gt=0.0)
    usual_log_amplitude: float
    usual_stroke_mps: tuple[PositiveFloat, PositiveFloat] | None = Field(
        description="how fast the springs of front and rear axle usually move; null: no member read a roll rate"
    )
    half_car: EvidencePart
    roll: EvidencePart | None = Field(description="null: no member read a roll rate")
    scatter_std: dict[str, Annotated[float, Field(gt=0.0, allow_inf_nan=False)]] = Field(
        description="of the difference between two vehicles: shares of what is positive, else in the unit that ends "
        "the name; what is not named here is each vehicle's own"
    )
    n_siblings: int = Field(ge=0, description="how many vehicles the scatter was estimated from; 0: the defaults")
    seen: LineSeenPart
    limits: LimitsPart

    @classmethod
    def of(cls, line: "Line") -> "LinePart":
        """The line as the file holds it."""
        names = PARAMETERS + ROLL_PARAMETERS
        seen = asdict(line.seen) | {"known_loads": tuple(astuple(load) for load in line.seen.known_loads)}
        stds = zip(names, line.scatter_std.tolist(), strict=True)
        return cls(
            members=line.members,
            wheelbase_m=line.wheelbase_m,
            empty_mass_kg=line.empty_mass_kg,
            usual_log_amplitude=line.usual.log_amplitude,
            usual_stroke_mps=line.usual.stroke_mps,
            half_car=EvidencePart.of(line.half_car, PARAMETERS),
            roll=None if line.roll is None else EvidencePart.of(line.roll, ROLL_PARAMETERS),
            scatter_std={name: std for name, std in stds if std > 0.0},
            n_siblings=line.n_siblings,
            seen=LineSeenPart(**seen),
            limits=LimitsPart(**asdict(line.limits)),
        )

    def require_known(self) -> None:
        """Raises CalibrationFileError where the model has other parameters today."""
        self.half_car.require_known(PARAMETERS)
        if self.roll is not None:
            self.roll.require_known(ROLL_PARAMETERS)

    def for_core(self) -> "Line":
        """The same in the core's terms. Raises as :meth:`require_known` does."""
        from gateway.calibration.line import Limits, Line, Seen, Usual  # noqa: PLC0415 # as above

        known_loads = tuple(Load(*load) for load in self.seen.known_loads)
        return Line(
            members=self.members,
            wheelbase_m=self.wheelbase_m,
            empty_mass_kg=self.empty_mass_kg,
            usual=Usual(self.usual_log_amplitude, self.usual_stroke_mps),
            half_car=self.half_car.for_core(PARAMETERS),
            roll=None if self.roll is None else self.roll.for_core(ROLL_PARAMETERS),
            scatter_std=_by_name(self.scatter_std),
            n_siblings=self.n_siblings,
            seen=Seen(**dict(self.seen) | {"known_loads": known_loads}),
            limits=Limits(**dict(self.limits)),
        )


def _by_name(stds: dict[str, float]) -> F64:
    """(n,) in the order of all parameters, 0 where none is named; a name of another model was told before."""
    ordered = np.zeros(len(INDEX))
    for name, std in stds.items():
        if name in INDEX:
            ordered[INDEX[name]] = std
    return ordered
