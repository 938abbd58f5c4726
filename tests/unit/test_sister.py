"""A sister's calibration as the prior of the next vehicle of her model."""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import VAN
from support.known_runs import SIBLING, calibrated_on_loads, known_run

from gateway.calibration.half_car.fit import SPRINGS_FROM_PRIORS, fit_cross_spectrum
from gateway.calibration.half_car.prior import prior_of
from gateway.calibration.sister import SCATTER_STD, Sister
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, upright
from gateway.errors import NoSisterError

N = len(PARAMETERS)
INHERITED = np.array([name in SCATTER_STD for name in PARAMETERS])


@pytest.fixture(scope="module")
def sister() -> Sister:
    return Sister("sha256:sister", VAN, calibrated_on_loads(seed=1))


def test_inherited_parameters_are_the_sisters_widened_by_the_scatter(sister: Sister) -> None:
    prior = sister.prior_of(VAN, with_roll=False)
    scatter = np.array([SCATTER_STD.get(name, 0.0) for name in PARAMETERS])
    variances = np.diag(sister.calibration.covariance[:N, :N]) + scatter**2
    assert prior.mean[INHERITED] == pytest.approx(upright(sister.calibration.parameters)[INHERITED])
    assert prior.std[INHERITED] == pytest.approx(np.sqrt(variances)[INHERITED])


def test_own_parameters_keep_the_prior_of_any_vehicle(sister: Sister) -> None:
    other = replace(VAN, sensor_position_m=1.0)
    prior, generic = sister.prior_of(other, with_roll=False), prior_of(other)
    assert prior.mean[~INHERITED] == pytest.approx(generic.mean[~INHERITED])
    assert prior.std[~INHERITED] == pytest.approx(generic.std[~INHERITED])


def test_one_empty_drive_weighs_like_the_sister(sister: Sister) -> None:
    empty = known_run(1, 0.0, None, seed=7, car=SIBLING)
    fitted = fit_cross_spectrum([empty], VAN, inherited=sister).calibration
    alone = fit_cross_spectrum([empty], VAN).calibration
    springs = [PARAMETERS.index(f"spring_{end}_npm") for end in ("front", "rear")]
    std, std_alone = np.sqrt(np.diag(fitted.covariance)), np.sqrt(np.diag(alone.covariance))
    assert np.all(std[springs] < 0.6 * std_alone[springs])
    assert fitted.payload_seen_kg == sister.calibration.payload_seen_kg
    assert SPRINGS_FROM_PRIORS in alone.warnings
    assert SPRINGS_FROM_PRIORS not in fitted.warnings


@pytest.mark.parametrize(
    ("changes", "why"),
    [({"wheelbase_m": 1.1 * VAN.wheelbase_m}, "another model"), ({"empty_mass_kg": 1.5 * VAN.empty_mass_kg}, "body")],
)
def test_a_vehicle_of_another_model_is_refused(sister: Sister, changes: dict[str, float], why: str) -> None:
    with pytest.raises(NoSisterError, match=why):
        sister.prior_of(replace(VAN, **changes), with_roll=False)


def test_a_sister_without_her_usual_movement_is_refused(sister: Sister) -> None:
    old = replace(sister, calibration=replace(sister.calibration, usual_log_amplitude=None))
    with pytest.raises(NoSisterError, match="calibrate it again"):
        _ = old.usual
