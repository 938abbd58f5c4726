"""A drive of which no two stretches are at one speed: every group of segments is one, and no misfit can be told."""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import VAN
from support.known_runs import known_run

from gateway.calibration.half_car.fit import fit_cross_spectrum
from gateway.calibration.known_run import KnownRun
from gateway.errors import CalibrationImpossibleError


def unsteady_run() -> KnownRun:
    """Eight stretches of a segment each, every one faster than that before it."""
    run = known_run(1, 0.0, None, seed=1)
    (batch,) = run.batches
    usable, speed_mps = np.zeros_like(batch.usable), batch.speed_mps.copy()
    for i in range(8):
        usable[1000 * i : 1000 * i + 256] = True
        speed_mps[1000 * i : 1000 * (i + 1)] = 8.0 * 1.12**i
    return replace(run, batches=(replace(batch, usable=usable, speed_mps=speed_mps),))


def test_it_is_refused_in_words_for_a_fitter() -> None:
    with pytest.raises(CalibrationImpossibleError, match="drive at an even speed"):
        fit_cross_spectrum([unsteady_run()], VAN)
