"""Errors of the load's lateral position, and of the wheel loads derived from it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final

import numpy as np

from gateway.calibration.judgement.coverage import interval_scores
from gateway.core.vehicle import Vehicle
from gateway.core.weights import Unsprung, weights_of
from gateway.estimate import Estimate, Quantity
from gateway.posterior import exactly
from gateway.records import F64

WHEELS: Final = ("front_left", "front_right", "rear_left", "rear_right")


@dataclass(frozen=True, slots=True)
class CgLeftErrors:
    """Of the centre of gravity's lateral position, in m. None without an estimate."""

    mean_abs_m: float | None
    bias_m: float | None
    std_m: float | None
    max_abs_m: float | None
    coverage95: float | None
    half_width_m: float | None = None
    interval_score_m: float | None = None

    def to_json(self) -> dict[str, float | None]:
        """The object that ``evaluate --json`` prints."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class WheelErrors:
    """Of the four wheels' loads in percent of the gross weight. None if they are not known."""

    mean_abs_pct_of_gross: float | None
    max_abs_pct_of_gross: float | None

    def to_json(self) -> dict[str, float | None]:
        """The object that ``evaluate --json`` prints."""
        return asdict(self)


def cg_left_errors(compared: F64) -> CgLeftErrors | None:
    """Of rows (n, 4): true, estimated, low and high of the 95 % interval. None if no truth is known."""
    told = compared[np.isfinite(compared[:, 0])]
    if not len(told):
        return None
    true, estimated, low, high = told[np.isfinite(told[:, 1])].T
    error = estimated - true
    if not error.size:
        return CgLeftErrors(None, None, None, None, None)
    return CgLeftErrors(
        mean_abs_m=float(np.mean(np.abs(error))),
        bias_m=float(np.mean(error)),
        std_m=float(np.std(error)),
        max_abs_m=float(np.max(np.abs(error))),
        coverage95=float(np.mean((low <= true) & (true <= high))),
        half_width_m=float(np.mean(0.5 * (high - low))),
        interval_score_m=float(np.mean(interval_scores(true, low, high))),
    )


@dataclass(frozen=True, slots=True)
class JudgedLoad:
    """The stated load of a batch and its estimate; the position is NaN if not stated."""

    payload_kg: float
    front_share_pct: float
    cg_left_m: float
    estimate: Estimate
    unsprung: Unsprung

    def wheels_off_pct(self, vehicle: Vehicle) -> F64:
        """(4,) errors of the wheels' loads in percent of the gross weight; NaN where either is unknown.

        A campaign does not state how the axles divide a sideways moment, and some do not state the unsprung masses: the
        truth takes both from the estimate, so their errors are in neither.
        """
        roll_share = Quantity(self.estimate.roll_share_front, 0.0)
        truth = exactly(self.payload_kg, self.front_share_pct, self.cg_left_m)
        true = weights_of(vehicle, truth, roll_share, self.unsprung)
        told = self.estimate.weights
        off_kg = [getattr(told, wheel).kg - getattr(true, wheel).kg for wheel in WHEELS]
        return np.array(off_kg) / true.gross.kg * 100.0


def wheel_errors(carried: Sequence[JudgedLoad], vehicle: Vehicle) -> WheelErrors | None:
    """Over all batches whose wheel loads are known, in truth and by the estimate; None if there is none."""
    off_pct = np.array([one.wheels_off_pct(vehicle) for one in carried]).reshape(-1, len(WHEELS))
    known = np.abs(off_pct[np.isfinite(off_pct).all(axis=1)])
    return WheelErrors(float(np.mean(known)), float(np.max(known))) if known.size else None
