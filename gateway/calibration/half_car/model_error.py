"""The error of the model itself: what runs left out of a fit showed beyond what the fit says of its own error.

Three batches of one run are one witness: they share load, road and speed. So errors are averaged over a run, compared
with the variance that the run's posterior predicts, and the variances that are left are pooled over runs. Few runs know
a variance badly: it is pooled with what other vans showed, as a scaled inverse chi-squared prior has it (A. Gelman et
al., Bayesian Data Analysis, 3rd ed., 2.6), and its uncertainty makes Student's t of the normal distribution.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import stdtrit

from gateway.quantity import Z95
from gateway.records import F64

USUAL_PAYLOAD_SHARE: Final = 0.004  # of the empty mass
USUAL_FRONT_SHARE_PCT: Final = 0.1
USUAL_CG_LEFT_M: Final = 0.002
"""Model errors of simulated vans that serve no other purpose (`benchmarks.accuracy budget`)."""
USUAL_PER_REACH: Final = 1.0  # how fast the error grows beyond the known loads: it doubles within an empty mass
USUAL_REACH: Final = 0.1  # of runs at the edge of a campaign, in parts of the empty mass
PRIOR_RUNS: Final = 6  # so many runs would outweigh what other vans showed
LEAST_PART: Final = 0.25  # of the usual variance: a campaign of one road and one speed shows less than there is


@dataclass(frozen=True, slots=True)
class RunError:
    """One left-out run: mean error (3,) of payload (kg), front share (%) and lateral place (m; NaN where unknown), the
    variances (3,) predicted for it without any error of the model, and how far its load lies beyond the others.
    """

    error: F64
    predicted: F64
    reach: float


@dataclass(frozen=True, slots=True)
class ModelError:
    """Standard deviations as in CrossSpectrumCalibration: what intervals of 95 % need, whatever the number of runs."""

    std: tuple[float, float, float]
    per_reach: tuple[float, float]


def model_error(runs: Sequence[RunError], empty_mass_kg: float) -> ModelError:
    """What these runs show; without any, what other vans showed."""
    usual = np.array([USUAL_PAYLOAD_SHARE * empty_mass_kg, USUAL_FRONT_SHARE_PCT, USUAL_CG_LEFT_M]) ** 2
    stds, grown = [], []
    for i, variance in enumerate(usual):
        known = [one for one in runs if np.isfinite(one.error[i])]
        within = [one.error[i] ** 2 - one.predicted[i] for one in known if one.reach == 0.0]
        pooled = max((PRIOR_RUNS * variance + sum(within)) / (PRIOR_RUNS + len(within)), LEAST_PART * variance)
        heavier = float(stdtrit(PRIOR_RUNS + len(within), 0.975)) / Z95
        stds.append(heavier * float(np.sqrt(pooled)))
        excess = [max(0.0, (one.error[i] ** 2 - one.predicted[i]) / pooled - 1.0) for one in known if one.reach > 0.0]
        reach2 = [one.reach**2 for one in known if one.reach > 0.0]
        weight = PRIOR_RUNS * USUAL_REACH**2
        grown.append(float(np.sqrt((weight * USUAL_PER_REACH**2 + sum(excess)) / (weight + sum(reach2)))))
    return ModelError((stds[0], stds[1], stds[2]), (grown[0], grown[1]))
