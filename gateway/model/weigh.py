"""The load of one batch: the maximum of the posterior under each hypothesis, and their mixture by source of error.

    by_cross_spectrum(batch, model, shapes, blank) -> Estimate

Both sensors are on one vehicle on one road, so the ratio of their signals at each frequency and speed does not depend
on the road. The peaks of the posterior (gateway.model.mixture) become an answer (gateway.model.answer), which is
refused where the batch contradicts the vehicle (gateway.model.checks). docs/method.md has the derivation.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gateway.core.cargo import ShapeHypothesis
from gateway.estimates.batch_estimate import Estimate
from gateway.estimates.posterior import PAYLOAD, Posterior
from gateway.model.answer import posterior_of
from gateway.model.checks import Signs, disbelieved, fits, reach_of, unseen_of, why_not
from gateway.model.mixture import (
    COARSE,
    MOST_LOAD_SHARE,
    BatchLikelihood,
    Mixture,
    Peak,
    climb,
    mixture_of,
    starting_loads,
)
from gateway.model.place import roll_share_of
from gateway.model.sensors import NOISE_RATIOS, Noise, gain_of, is_changed, noise_of, watched
from gateway.model.spectra import CrossSpectra, cross_spectra_of
from gateway.model.table import INDEX, N
from gateway.model.vehicle_model import VehicleModel
from gateway.model.whittle import Whittle
from gateway.records import Batch, Why

MOST_LAG_LEFT_S: Final = 0.002  # beyond it, roll is taken out again, at the lag that was found
MOST_LAGS: Final = 4  # tried; a lag that still moves has no fixed point
_LAG: Final = INDEX["gyro_lag_s"]


@dataclass(frozen=True, slots=True, eq=False)
class Weighed:
    """The result of a batch's spectra: the peaks, what they show of themselves, and the answer."""

    spectra: CrossSpectra
    mixture: Mixture
    signs: Signs
    noise: Noise
    posterior: Posterior


_BY_NOISE: Final = (
    Why.SENSOR_DISAGREEMENT,
    Why.SENSOR_CHANGED,
    Why.WRONG_SIGN,
    Why.MODEL_MISFIT,
    Why.TOO_UNCERTAIN,
    Why.AMBIGUOUS,
    Why.NO_SOLUTION,
)
"""Reasons that a noisy sensor can cause."""


def by_cross_spectrum(
    batch: Batch, model: VehicleModel, shapes: Sequence[ShapeHypothesis], blank: Estimate
) -> Estimate:
    """``blank`` with payload, front share and diagnostics of the batch, or with the reason for a refusal."""
    of_sensors = watched(batch, model)
    found = weigh(batch, model, shapes)
    if isinstance(found, Why):
        return replace(blank, diagnostics=of_sensors, rejected=(found,))
    diagnosed = replace(blank, diagnostics={**_diagnostics(found, model), **of_sensors})
    why = disbelieved(found.signs)
    if why is not None:
        return replace(diagnosed, rejected=(Why.SENSOR_NOISY if found.noise.is_there and why in _BY_NOISE else why,))
    answer = diagnosed.answered(found.posterior)
    if found.mixture.place is None:
        return answer
    share = roll_share_of(found.mixture.point, model)
    return replace(answer, roll_share_front=share.number, roll_share_front_std=share.std)


def weigh(batch: Batch, model: VehicleModel, shapes: Sequence[ShapeHypothesis]) -> Weighed | Why:
    """The load of a batch, however badly it fits, or why it cannot be compared with the model."""
    spectra = cross_spectra_of([batch], model.reading)
    why = why_not(batch, spectra, model) or (Why.SENSOR_CHANGED if is_changed(batch, model) else None)
    if spectra is None or why in (Why.NOT_ENOUGH_EXCITATION, Why.SENSOR_CHANGED):
        return why or Why.TOO_SHORT
    noise = noise_of(batch, spectra, model)
    if why is not None:
        return Why.SENSOR_NOISY if noise.is_there else why
    gain = gain_of(batch.gravity_mps2, model.gravity_mps2)
    taken_out_s = float(model.parameters[_LAG])
    for _ in range(MOST_LAGS):
        spectra = replace(spectra, noise=noise.on(spectra))
        mixture = mixture_of(spectra, model, shapes, gain)
        lag_s = float(mixture.best.x[_LAG])
        is_settled = mixture.place is None or abs(lag_s - taken_out_s) <= MOST_LAG_LEFT_S
        if is_settled:
            break
        again = cross_spectra_of([batch], model.reading.with_gyro_late_by(lag_s))
        spectra, taken_out_s = spectra if again is None else again, lag_s
    reach = reach_of(mixture.best.load, model)
    unseen = unseen_of(batch.mean_speed_mps, spectra.acceleration_rms_mps2, reach, model)
    posterior = posterior_of(mixture, model, unseen, gain[1])
    signs = _signs_of(mixture, model, unseen, reach, noise, posterior, is_settled=is_settled)
    return Weighed(spectra, mixture, signs, noise, posterior)


def _signs_of(
    mixture: Mixture,
    model: VehicleModel,
    unseen: float,
    reach: float,
    noise: Noise,
    posterior: Posterior,
    *,
    is_settled: bool,
) -> Signs:
    best, whittle, point = mixture.best, mixture.whittle, mixture.point
    misfit = followed = whittle.misfit(point)
    followed_by = best
    if not fits(misfit, model, unseen):
        followed_by, followed = _following(mixture, model)
    between = float(mixture.weights @ np.array([one.x[N] - best.x[N] for one in mixture.peaks]) ** 2)
    return Signs(
        model=model,
        misfit=misfit,
        followed=followed,
        unseen=unseen,
        reach=reach,
        is_reversed=_is_reversed(mixture, model, misfit),
        off=followed_by.x[:N] - model.parameters[:N],
        deviations=followed_by.deviations,
        tension=best.tension,
        loudness=noise.loudness,
        is_mount_changed=mixture.place is not None and mixture.place.is_mount_changed,
        is_settled=is_settled and mixture.is_converged,
        payload_std_kg=posterior.std(PAYLOAD),
        rivalry=between / max(posterior.std(PAYLOAD) ** 2 - between, 1e-9),
    )


def _following(mixture: Mixture, model: VehicleModel) -> tuple[Peak, float]:
    """The likeliest peak if all of the batch's evidence counts, and its misfit: what may explain that it does not
    fit.
    """
    whittle = Whittle(mixture.whittle.spectra, mixture.whittle.ground)
    own = _own_by(whittle, mixture, model)
    peak = climb(own, mixture.best.hypothesis, mixture.best.x, COARSE)
    return peak, whittle.misfit(own.point(peak.x))


def _own_by(whittle: Whittle, mixture: Mixture, model: VehicleModel) -> BatchLikelihood:
    """Another likelihood of the batch, with roll and the lateral place as the mixture has them."""
    return BatchLikelihood(
        whittle, mixture.point.theta[N:], mixture.point.cg_left_m, MOST_LOAD_SHARE * model.empty_mass_kg
    )


def _is_reversed(mixture: Mixture, model: VehicleModel, misfit: float) -> bool:
    """True if the pitch rate fits better with the other sign: at this load or, if this fits badly, at any start; or if
    the search from there ends where the model fits.

    Spectra with the wrong sign may lead the search to a load where neither sign fits.
    """
    whittle, point = mixture.whittle, mixture.point
    reverse = whittle.showing(whittle.spectra.with_pitch_reversed())
    least = reverse.cost(point)
    if not misfit <= model.misfit_limit:
        own = _own_by(reverse, mixture, model)
        starts = [np.r_[mixture.best.hypothesis.mean, load] for load in starting_loads(model)]
        costs = reverse.costs([own.point(one) for one in starts])
        peak = climb(own, mixture.best.hypothesis, starts[int(np.argmin(costs))], COARSE)
        least = min(least, float(costs.min()))
        if reverse.misfit(own.point(peak.x)) <= model.misfit_limit:
            return True
    return least < whittle.cost(point)


def _diagnostics(found: Weighed, model: VehicleModel) -> dict[str, float]:
    spectra, signs, best = found.spectra, found.signs, found.mixture.best

    def of(name: str) -> float:
        return float(best.x[INDEX[name]])

    return {
        "reach": signs.reach,
        "misfit": signs.misfit,
        "n_segments": float(spectra.n_total),
        "amplitude_ratio": math.exp(spectra.log_amplitude_mean),
        "damper_front_ratio": math.exp(signs.changed("damper_front_nspm")),
        "damper_rear_ratio": math.exp(signs.changed("damper_rear_nspm")),
        "delay_scale": of("delay_scale"),
        "tension": signs.tension,
        "sensor_position_deviation": signs.deviation("sensor_position_m"),
        "sensor_noise_deviation": signs.deviation("noise_acceleration_m2ps3"),
        **dict(zip(NOISE_RATIOS, found.noise.loudness.tolist(), strict=False)),
        "payload_gyration_m2": math.exp(of("payload_gyration_m2")),
        "payload_mode_hz": math.exp(of("payload_mode_hz")),
        "payload_damping_ratio": math.exp(of("payload_damping_ratio")),
        "delay_s": spectra.delay_mean_s,
        "delay_std_s": spectra.delay_std_s,
    }
