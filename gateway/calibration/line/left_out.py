"""Siblings left out in turn: each is calibrated by one empty drive of its own and the others' prior, then judged."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gateway.calibration.half_car.fit import fit_cross_spectrum
from gateway.calibration.half_car.known_spectra import known_spectra
from gateway.calibration.half_car.left_out import LeftOut, left_out_errors, limits_shown_by
from gateway.calibration.half_car.prior import can_roll
from gateway.calibration.known_run import KnownRun
from gateway.calibration.line.line import Line, Sister, line_of
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.errors import LineError


@dataclass(frozen=True, slots=True)
class Sibling:
    """A vehicle of the line with its calibration drives."""

    sister: Sister
    runs: tuple[KnownRun, ...]

    def inheriting_from(self, line: Line) -> CrossSpectrumCalibration:
        """Its calibration from one empty drive."""
        return fit_cross_spectrum([self._empty], self.sister.vehicle, inherited=line).calibration

    def errors_of(self, calibration: CrossSpectrumCalibration) -> list[LeftOut]:
        """The errors of every batch of its other drives."""
        rest = [run for run in self.runs if run is not self._empty]
        vehicle = self.sister.vehicle
        known = known_spectra(rest, vehicle, with_roll=can_roll(vehicle))
        return [error for one in known for error in left_out_errors(one, calibration)]

    @property
    def is_judgeable(self) -> bool:
        """Whether it has an empty drive and at least one more."""
        return len(self.runs) > 1 and any(run.payload_kg == 0.0 for run in self.runs)

    @property
    def _empty(self) -> KnownRun:
        return next(run for run in self.runs if run.payload_kg == 0.0)


@dataclass(frozen=True, slots=True)
class TestedLine:
    """A line with the limits found by leaving siblings out, and their root mean square errors."""

    line: Line
    payload_rms_kg: float
    front_share_rms_pct: float


def with_siblings_left_out(
    siblings: Sequence[Sibling], line: Line, step: Callable[[], None] = lambda: None
) -> TestedLine:
    """``line`` of all vehicles, with the limits that ``siblings`` show, each left out of a line of its own.

    ``step`` is called after each. Raises LineError if none can be left out: one needs an empty drive and another one,
    and a second vehicle must remain.
    """
    judgeable = [one for one in siblings if one.is_judgeable]
    if len(siblings) < 2 or not judgeable:
        raise LineError(
            "no sibling can be left out: give the drives of two vehicles, at least one of them driven empty and loaded"
        )
    errors: list[LeftOut] = []
    misfits = []
    for one in judgeable:
        others = [each.sister for each in siblings if each is not one]
        calibration = one.inheriting_from(line_of(others))
        misfits.append(calibration.misfit_limit)
        errors += one.errors_of(calibration)
        step()
    if not errors:
        raise LineError("no batch of a sibling left out could be weighed: their drives hold too little steady driving")
    return TestedLine(
        replace(line, limits=limits_shown_by(errors, max(misfits), line.empty_mass_kg)),
        float(np.sqrt(np.mean([one.error[0] ** 2 for one in errors]))),
        float(np.sqrt(np.mean([one.error[1] ** 2 for one in errors]))),
    )
