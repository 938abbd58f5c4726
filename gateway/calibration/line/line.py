"""A line of vehicles: calibrations of several vehicles give the prior of the next one before its first drive.

    line = line_of(sisters)
    line.prior_of(vehicle, with_roll=...)

Vehicle i of a line has the parameters N(mu, S / 2), so that two of them differ by N(0, S). A sister's drives are
evidence on her own parameters; widened by S / 2 they are evidence on the line's mean mu; all sisters' together, widened
by S / 2 again, on the next vehicle. So one sister's covariance grows by S, that of many by S / 2. That evidence and the
prior of any vehicle (half_car.prior) are multiplied. Without scatter all drives count as one vehicle's; with unlimited
scatter a line has no information. Heave and pitch are learned separately from roll, as in the fit itself
(docs/adr/roll-takes-turns.md).
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import Final

import numpy as np

from gateway.calibration.half_car.fit import SPRINGS_FROM_PRIORS
from gateway.calibration.half_car.prior import Prior, prior_of
from gateway.calibration.inheritance import ModelLimits, Seen, Usual
from gateway.calibration.line.evidence import Evidence
from gateway.calibration.line.scatter import (
    LEAST_SIBLINGS,
    SCATTER_DOF,
    default_scatter_std,
    is_inherited,
    scatter_found,
)
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, ROLL_PARAMETERS, has_roll, upright
from gateway.core.vehicle import Vehicle
from gateway.errors import LineError
from gateway.records import F64

MOST_WHEELBASE_DIFFERENCE: Final = 0.01  # chosen: of the wheelbase; a larger difference is another model
MOST_MASS_DIFFERENCE: Final = 0.25  # chosen: of the sprung mass; a larger difference is another body
_N: Final = len(PARAMETERS)
_IS_INHERITED: Final = is_inherited(PARAMETERS + ROLL_PARAMETERS)


@dataclass(frozen=True, slots=True)
class Line:
    """Evidence on a line's mean from several vehicles; ``members`` are the ids of their calibrations.

    ``half_car`` and ``roll`` are that evidence, roll None if no member used a roll rate. scatter_std (n,) is that of
    the difference between two vehicles, in the order of PARAMETERS and ROLL_PARAMETERS, 0 for a vehicle's own
    parameters; it was estimated from n_siblings, or is the default if these are 0.
    """

    members: tuple[str, ...]
    wheelbase_m: float
    empty_mass_kg: float
    usual: Usual
    half_car: Evidence
    roll: Evidence | None
    scatter_std: F64
    n_siblings: int
    seen: Seen
    limits: ModelLimits

    def prior_of(self, vehicle: Vehicle, *, with_roll: bool) -> Prior:
        """The prior of the next vehicle, with its stated masses and sensor. Raises LineError if it does not belong to
        the line.
        """
        _require_alike(self, vehicle)
        generic = prior_of(vehicle, with_roll=with_roll)
        variance = _about_mean(self.scatter_std)
        half_car = self.half_car.of_another(variance[:_N]).upon(generic.upright)
        if not with_roll:
            return half_car
        return half_car.beside(self.roll.of_another(variance[_N:]).upon(generic.roll) if self.roll else generic.roll)

    def on(self, calibration: CrossSpectrumCalibration, *, is_tested: bool) -> CrossSpectrumCalibration:
        """See half_car.inherited: the calibration valid over the line's ranges, with its limits."""
        wider = self.limits.on(self.seen.on(calibration), is_tested=is_tested)
        low_kg, high_kg = wider.payload_seen_kg
        kept = tuple(one for one in wider.warnings if low_kg == high_kg or one != SPRINGS_FROM_PRIORS)
        return replace(wider, warnings=kept)


@dataclass(frozen=True, slots=True)
class Sister:
    """A calibrated vehicle of a line: its calibration with the id of its file, and the line it inherited from."""

    id: str
    vehicle: Vehicle
    calibration: CrossSpectrumCalibration
    line: Line | None = None

    @property
    def usual(self) -> Usual:
        """Raises LineError if the calibration lacks it."""
        c = self.calibration
        if c.usual_log_amplitude is None:
            raise LineError(f"{self.vehicle.name} ({self.id}): does not contain its usual movement: calibrate it again")
        return Usual(c.usual_log_amplitude, c.usual_stroke_mps)

    @property
    def half_car(self) -> Evidence:
        """The evidence of its own drives on heave and pitch, without its own parameters."""
        c, prior = self.calibration, self._prior.upright
        return Evidence.of(upright(c.parameters), c.covariance[:_N, :_N], prior, _IS_INHERITED[:_N])

    @property
    def roll(self) -> Evidence | None:
        """The same on roll."""
        c = self.calibration
        if not has_roll(c.parameters):
            return None
        return Evidence.of(c.parameters[_N:], c.covariance[_N:, _N:], self._prior.roll, _IS_INHERITED[_N:])

    @property
    def _prior(self) -> Prior:
        with_roll = has_roll(self.calibration.parameters)
        return (self.line.prior_of if self.line else prior_of)(self.vehicle, with_roll=with_roll)


def line_of(sisters: Sequence[Sister], line: Line | None = None) -> Line:
    """The line of ``sisters``, with ``line`` if one was built already; their order does not matter.

    The line that a sister inherited from is included. Raises LineError if lines overlap, or vehicles differ too much.
    """
    sisters = sorted({one.id: one for one in sisters}.values(), key=lambda one: one.id)
    lines = _distinct([*([line] if line else []), *(one.line for one in sisters if one.line)])
    known = {member for each in lines for member in each.members}
    sisters = [one for one in sisters if one.id not in known]
    if len(lines) == 1 and not sisters:
        return lines[0]
    if not lines and not sisters:
        raise LineError("a line needs the calibration of at least one vehicle")
    usual = Usual.mean([*(one.usual for one in sisters), *(each.usual for each in lines)])
    found = [_at(one.half_car, one, usual) for one in sisters]
    rolls = [roll for one in sisters if (roll := one.roll) is not None]
    scatter_std, n_siblings = _scatter(found, rolls, lines)
    variance = _about_mean(scatter_std)
    of_line = [_line_at(each, usual) for each in lines]
    built = Line(
        members=tuple(sorted([*known, *(one.id for one in sisters)])),
        wheelbase_m=fmean([*(one.vehicle.wheelbase_m for one in sisters), *(each.wheelbase_m for each in lines)]),
        empty_mass_kg=fmean([*(one.vehicle.empty_mass_kg for one in sisters), *(each.empty_mass_kg for each in lines)]),
        usual=usual,
        half_car=_sum([*of_line, *(one.of_another(variance[:_N]) for one in found)]),
        roll=_sum_or_none(
            [*(each.roll for each in lines if each.roll), *(one.of_another(variance[_N:]) for one in rolls)]
        ),
        scatter_std=scatter_std,
        n_siblings=n_siblings,
        seen=Seen.together([*(each.seen for each in lines), *(Seen.of(one.calibration) for one in sisters)]),
        limits=ModelLimits.widest(
            [*(each.limits for each in lines), *(ModelLimits.of(one.calibration) for one in sisters)]
        ),
    )
    for one in sisters:
        _require_alike(built, one.vehicle)
    return built


def _scatter(found: Sequence[Evidence], rolls: Sequence[Evidence], lines: Sequence[Line]) -> tuple[F64, int]:
    """The scatter estimated from three sisters on, with their lines' as default, else the defaults."""
    std, n = default_scatter_std(PARAMETERS + ROLL_PARAMETERS), 0
    if lines:
        std, n = np.mean([each.scatter_std for each in lines], axis=0), max(each.n_siblings for each in lines)
    if len(found) < LEAST_SIBLINGS:
        return std, n
    variance = _about_mean(std)
    variance[:_N] = scatter_found(found, variance[:_N], SCATTER_DOF + n)
    if len(rolls) >= LEAST_SIBLINGS:
        variance[_N:] = scatter_found(rolls, variance[_N:], SCATTER_DOF + n)
    return np.sqrt(2.0 * variance), n + len(found)


def _about_mean(scatter_std: F64) -> F64:
    """Variance (n,) of vehicles about their mean: half of that between two."""
    return 0.5 * scatter_std**2


def _at(evidence: Evidence, sister: Sister, usual: Usual) -> Evidence:
    """The evidence at the line's usual amplitude."""
    return evidence.at_amplitude(upright(sister.calibration.parameters), sister.usual.log_over(usual))


def _line_at(line: Line, usual: Usual) -> Evidence:
    """The same for a line, about the mean of its evidence."""
    mean = np.linalg.pinv(line.half_car.information, hermitian=True) @ line.half_car.pull
    return line.half_car.at_amplitude(np.asarray(mean, float), line.usual.log_over(usual))


def _distinct(lines: Iterable[Line]) -> list[Line]:
    """Each line once. Raises LineError if two share members but not all: their evidence would count twice."""
    once = {each.members: each for each in lines}
    kept: list[Line] = []
    for members in sorted(once):
        if any(set(members) & set(other.members) for other in kept):
            raise LineError(
                "two of these were made from lines that share vehicles: their drives would count twice; build one line "
                "of all plain calibrations with `springscale line build`"
            )
        kept.append(once[members])
    return kept


def _require_alike(line: Line, vehicle: Vehicle) -> None:
    off_m, off_kg = vehicle.wheelbase_m - line.wheelbase_m, vehicle.empty_mass_kg - line.empty_mass_kg
    if abs(off_m) > MOST_WHEELBASE_DIFFERENCE * line.wheelbase_m:
        raise LineError(
            f"{vehicle.name}: wheelbase {vehicle.wheelbase_m:g} m, that of the line {line.wheelbase_m:.4g} m: "
            "another model; give calibrations of its own line"
        )
    if abs(off_kg) > MOST_MASS_DIFFERENCE * line.empty_mass_kg:
        raise LineError(
            f"{vehicle.name}: sprung mass {vehicle.empty_mass_kg:g} kg, that of the line {line.empty_mass_kg:.4g} kg: "
            "another body; give calibrations of vehicles like it"
        )


def _sum(parts: Sequence[Evidence]) -> Evidence:
    return sum(parts[1:], parts[0])


def _sum_or_none(parts: Sequence[Evidence]) -> Evidence | None:
    return _sum(parts) if parts else None
