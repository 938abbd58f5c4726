"""Constants of the estimator, of fusion and of inspection that were chosen, not derived."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from importlib import import_module
from typing import Final

FACTORS: Final = (0.5, 2.0)  # chosen: half and double
USED_IN: Final = (
    "gateway.core.cross_spectrum",
    "gateway.core.fusion",
    "gateway.core.change",
    "gateway.core.cargo",
    "gateway.calibration.half_car",
    "gateway.calibration.plan",
    "gateway.calibration.inspection",
)
"""Packages in which a constant is set; elsewhere the same name may be another constant."""


class Acts(StrEnum):
    """The step that a constant affects, which is repeated with another value."""

    IN_CALIBRATION = "calibration"
    IN_WEIGHING = "weighing"
    IN_INSPECTION = "inspection"


@dataclass(frozen=True, slots=True)
class Constant:
    """``name`` in ``module``, and its effect in a few words."""

    name: str
    module: str
    acts: Acts
    decides: str

    @property
    def current(self) -> float | tuple[float, ...]:
        """Its value in the code."""
        found: float | tuple[float, ...] = getattr(import_module(self.module), self.name)
        return found


CONSTANTS: Final = (
    Constant(
        "EVIDENCE_WEIGHT", "gateway.core.cross_spectrum.likelihood", Acts.IN_CALIBRATION,
        "how much of their evidence drives keep beside what is known beforehand",
    ),
    Constant(
        "N_SEGMENT", "gateway.calibration.half_car.known_spectra", Acts.IN_CALIBRATION,
        "samples in a segment: finer in frequency, or more segments",
    ),
    Constant(
        "ROAD_RIPPLE", "gateway.core.cross_spectrum.likelihood", Acts.IN_CALIBRATION,
        "how straight a road's spectrum is believed to be",
    ),
    Constant(
        "LEVEL_STEPS", "gateway.core.cross_spectrum.model.friction", Acts.IN_CALIBRATION,
        "how far apart the amplitudes are at which a vehicle with friction is solved",
    ),
    Constant(
        "MISFIT_ON_OTHER_ROADS", "gateway.core.cross_spectrum.estimator", Acts.IN_CALIBRATION,
        "how much better or worse than in calibration batches fit on other roads",
    ),
    Constant(
        "SCORE_MARGIN", "gateway.calibration.half_car.left_out", Acts.IN_CALIBRATION,
        "how much more like a moved sensor than in calibration it may look",
    ),
    Constant(
        "UNSEEN_SPEED_SCALE", "gateway.core.cross_spectrum.estimator", Acts.IN_WEIGHING,
        "how fast intervals widen away from calibrated speeds",
    ),
    Constant(
        "UNSEEN_ROUGHNESS_SCALE", "gateway.core.cross_spectrum.estimator", Acts.IN_WEIGHING,
        "how fast they widen on smoother and rougher roads",
    ),
    Constant(
        "UNSEEN_PLACE_PART", "gateway.core.cross_spectrum.estimator", Acts.IN_WEIGHING,
        "how much of that growth the lateral place takes",
    ),
    Constant(
        "EVIDENCE", "gateway.core.cross_spectrum.shape", Acts.IN_WEIGHING,
        "how much a batch's evidence counts against calibration and nature",
    ),
    Constant(
        "SHAPE_EVIDENCE", "gateway.core.cross_spectrum.shape", Acts.IN_WEIGHING,
        "how many times as much it counts against shapes",
    ),
    Constant(
        "EVIDENCE_DOF", "gateway.core.cross_spectrum.shape", Acts.IN_WEIGHING,
        "how slowly a shape that it speaks against becomes impossible",
    ),
    Constant(
        "SPREAD_PART", "gateway.core.cargo", Acts.IN_WEIGHING,
        "the share of undeclared loads that are unlike the known loads",
    ),
    Constant(
        "COMPACT_SCATTER", "gateway.core.cargo", Acts.IN_WEIGHING,
        "how alike the others are to the known ones",
    ),
    Constant(
        "ROLLING", "gateway.core.change", Acts.IN_WEIGHING,
        "how likely a change of load is between two batches without a stop",
    ),
    Constant(
        "SPREAD_SHARE", "gateway.core.change", Acts.IN_WEIGHING,
        "how large such a change usually is",
    ),
    Constant(
        "LEAST_EVIDENCE", "gateway.calibration.inspection.loads", Acts.IN_INSPECTION,
        "from when on two loads count as swapped",
    ),
    Constant(
        "DOUBT_EVIDENCE", "gateway.calibration.inspection.loads", Acts.IN_INSPECTION,
        "from when on a label is doubted",
    ),
    Constant(
        "DOUBT_STDS", "gateway.calibration.inspection.loads", Acts.IN_INSPECTION,
        "how far off the others must weigh it",
    ),
    Constant(
        "LEAST_COHERENCE", "gateway.calibration.inspection.axes", Acts.IN_INSPECTION,
        "from when on two sensors move as one body",
    ),
    Constant(
        "LEAST_AGREEMENT", "gateway.calibration.inspection.axes", Acts.IN_INSPECTION,
        "from when on phases are a vehicle's",
    ),
    Constant(
        "REVERSED_BY", "gateway.calibration.inspection.axes", Acts.IN_INSPECTION,
        "by how much better the other sign must fit",
    ),
)  # fmt: skip


@contextmanager
def scaled(constant: Constant, factor: float) -> Iterator[None]:
    """Multiply the constant in all modules of USED_IN that hold it, and restore it afterwards."""
    current = constant.current
    if isinstance(current, tuple):
        other: float | tuple[float, ...] = tuple(factor * one for one in current)
    else:
        other = type(current)(factor * current)  # a number of samples stays whole
    holders = [
        module
        for name, module in list(sys.modules.items())
        if name.startswith(USED_IN) and module.__dict__.get(constant.name) is current
    ]
    try:
        for module in holders:
            setattr(module, constant.name, other)
        yield
    finally:
        for module in holders:
            setattr(module, constant.name, current)
