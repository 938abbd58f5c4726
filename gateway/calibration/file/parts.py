"""The tables that only calibration and line files have; vehicle and estimators are the core's own records in them."""

from typing import Annotated, Final, Self

import numpy as np
from pydantic import Field, model_validator

from gateway.calibration.inheritance import ModelLimits, Seen, Usual
from gateway.core.cross_spectrum.model.parameters import INDEX, PARAMETERS, ROLL_PARAMETERS
from gateway.errors import CalibrationFileError
from gateway.records import F64
from gateway.schema import check_shapes
from gateway.stated.facts import Part


class SeenPart(Part):
    """The ranges that the identification runs covered, and those of its line: the ranges of validity."""

    payload_kg: tuple[float, float]
    front_share_pct: tuple[float, float]
    speed_mps: tuple[float, float]
    sensor_rate_hz: tuple[float, float] | None = Field(
        description="lower sending rate of accelerometer and gyro; null: not known"
    )
    roughness_mps2: tuple[float, float] | None = Field(
        description="of the roads: vertical acceleration, root mean square from 1 to 15 Hz, scaled to 80 km/h"
    )


class RunPart(Part):
    """One known-load drive: the source of its numbers."""

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


NAMES: Final = PARAMETERS + ROLL_PARAMETERS


class EvidencePart(Part):
    """The members' information on the line's mean: the inverse of a covariance, and that times the mean."""

    names: tuple[str, ...]
    information: F64
    pull: F64

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        n = len(self.names)
        check_shapes(information=(self.information, (n, n)), pull=(self.pull, (n,)))
        if not np.array_equal(self.information, self.information.T):
            raise ValueError("information is not symmetric")
        return self

    @classmethod
    def of(cls, information: F64, pull: F64, names: tuple[str, ...]) -> Self:
        """Of the ``names`` (n,) with information, from information (n, n) and pull (n,)."""
        known = np.flatnonzero(np.any(information != 0.0, axis=1))
        return cls(
            names=tuple(names[i] for i in known), information=information[np.ix_(known, known)], pull=pull[known]
        )

    def spread(self, names: tuple[str, ...]) -> tuple[F64, F64]:
        """Information (n, n) and pull (n,) of all ``names``, zero for unknown ones."""
        at = [names.index(name) for name in self.names]
        information, pull = np.zeros((len(names), len(names))), np.zeros(len(names))
        information[np.ix_(at, at)] = self.information
        pull[at] = self.pull
        return information, pull


class LinePart(Part):
    """The prior for the next vehicle of a line from the calibrations of several; see calibration.line.line."""

    members: tuple[str, ...] = Field(min_length=1, description="ids of the calibrations it was made of")
    wheelbase_m: float = Field(gt=0.0)
    empty_mass_kg: float = Field(gt=0.0)
    usual: Usual
    half_car: EvidencePart
    roll: EvidencePart | None = Field(description="null: no member read a roll rate")
    scatter_std: dict[str, Annotated[float, Field(gt=0.0, allow_inf_nan=False)]] = Field(
        description="of the difference between two vehicles: relative for positive quantities, else in the unit that "
        "ends the name; unnamed ones are each vehicle's own"
    )
    n_siblings: int = Field(ge=0, description="how many vehicles the scatter was estimated from; 0: the defaults")
    seen: Seen
    limits: ModelLimits

    def require_known(self) -> None:
        """Raises CalibrationFileError if today's model has other parameters."""
        unknown = set(self.half_car.names) - set(PARAMETERS)
        unknown |= set(self.roll.names if self.roll else ()) - set(ROLL_PARAMETERS)
        if unknown:
            raise CalibrationFileError(
                "the line was built with another vehicle model than this springscale has "
                f"({', '.join(sorted(unknown))}): calibrate its vehicles again"
            )

    @property
    def scatter(self) -> F64:
        """``scatter_std`` (n,) in the order of NAMES, 0 if not named."""
        ordered = np.zeros(len(NAMES))
        for name, std in self.scatter_std.items():
            if name in INDEX:  # another model's name is refused by ``require_known``
                ordered[INDEX[name]] = std
        return ordered
