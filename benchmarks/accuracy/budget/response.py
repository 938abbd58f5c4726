"""The shift of an answer when the true springs, tyres and dampers differ from the calibration."""

from collections.abc import Mapping

import numpy as np

from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import DRIFT_STD, DRIFTING, STEADY
from gateway.core.cross_spectrum.estimator import Weighed
from gateway.core.cross_spectrum.likelihood import Whittle
from gateway.core.cross_spectrum.located import Answer, answer_at, precision_of
from gateway.core.cross_spectrum.model.parameters import PARAMETERS
from gateway.core.cross_spectrum.model.strokes import with_strokes
from gateway.core.cross_spectrum.packing import Packing
from gateway.core.cross_spectrum.shape import EVIDENCE, EVIDENCE_WITHOUT_ROLL
from gateway.posterior import Source
from gateway.records import F64

_OUTWARD = np.diag([1.0, 100.0])  # kg, and percent of 0..1


def response_to(found: Weighed, calibration: CrossSpectrumCalibration, day: Mapping[str, float]) -> F64:
    """(2,) shift in kg and percent, to first order: the data follow the truth, and the fit attributes the change to the
    load.

    A parameter fixed in the fit shifts the load by minus its slope; a drifting one is fitted except for the part that
    its prior holds back.
    """
    prior = _prior(found, calibration)
    at = _at(found, calibration, prior)
    steady = at.steady[-2:] @ [day.get(PARAMETERS[i], 0.0) for i in STEADY]
    drifting = _held_back(at, prior) @ [day.get(PARAMETERS[i], 0.0) for i in DRIFTING]
    response: F64 = -_OUTWARD @ (steady + drifting)
    return response


def day_covariance(found: Weighed, calibration: CrossSpectrumCalibration) -> F64:
    """(2, 2) covariance that the posterior states for the day: its columns, and the search's own prior of dampers,
    which is a part of the batch's own covariance.
    """
    is_damper = np.array([name.startswith("damper_") for name in DRIFT_STD], dtype=float)
    prior = _prior(found, calibration)
    believed = np.linalg.inv(prior.precision) * np.outer(is_damper, is_damper)
    held = _OUTWARD @ _held_back(_at(found, calibration, prior), prior)
    columns = found.posterior.sources[Source.DAY]
    covariance: F64 = columns.T @ columns + held @ believed @ held.T
    return covariance


def _prior(found: Weighed, calibration: CrossSpectrumCalibration) -> Packing:
    return Packing(calibration.parameters[DRIFTING], precision_of(found.spectra, calibration))


def _at(found: Weighed, calibration: CrossSpectrumCalibration, prior: Packing) -> Answer:
    point, ground = found.located.point, calibration.ground
    spectra = with_strokes(found.spectra.without_roll, calibration.parameters, point.load, ground)
    evidence = EVIDENCE_WITHOUT_ROLL if found.located.sideways is None else EVIDENCE
    return answer_at(Whittle(spectra, ground), point, calibration, prior, evidence, is_shape_known=False)


def _held_back(at: Answer, prior: Packing) -> F64:
    """(2, k) derivative of the load by the drifting parameters."""
    held: F64 = at.marginal[-2:, : len(DRIFTING)] @ prior.precision
    return held
