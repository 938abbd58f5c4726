"""What runs left out of a fit say of the model's error."""

from collections.abc import Iterator, Sequence

import numpy as np
import pytest

from gateway.calibration.left_out import LEAST_PART, USUAL_PAYLOAD_SHARE, LeftOut, ModelErrors, model_errors_shown_by
from gateway.estimates.posterior import Posterior

EMPTY_KG = 1500.0
OWN_KG = 10.0  # standard deviation of each batch's own error, as the posterior states it
STATED = 2.0  # misfit limit of the fit of all
SOUND_KG = (-9.0, 4.0, 11.0, -6.0, 8.0, -12.0, 3.0, 7.0, -10.0)


def left_out(errors_kg: Sequence[float], n_batches: int = 3) -> Iterator[LeftOut]:
    """Runs of some batches each, all of a run with the same error of the payload."""
    posterior = Posterior(np.zeros(2), np.diag([OWN_KG**2, 0.1**2]))
    for number, error_kg in enumerate(errors_kg):
        error = np.array([error_kg, 0.0])
        yield from [LeftOut(f"run {number}", error, np.zeros(2), posterior, 0.0, 1.0, is_compact=True)] * n_batches


def shown_by(errors_kg: Sequence[float], n_batches: int = 3) -> ModelErrors:
    return model_errors_shown_by(list(left_out(errors_kg, n_batches)), STATED, EMPTY_KG)


def test_no_run_leaves_the_error_of_other_vans() -> None:
    assert model_errors_shown_by([], STATED, EMPTY_KG) == ModelErrors.usual(EMPTY_KG, STATED)


def test_runs_that_err_widen_and_runs_that_hardly_err_narrow_to_a_part() -> None:
    usual = ModelErrors.usual(EMPTY_KG, STATED).model_std[0]
    assert shown_by([60.0, -50.0, 70.0, -65.0]).model_std[0] > 2.0 * usual
    least = shown_by([0.0] * 40).model_std[0]
    assert least == pytest.approx(LEAST_PART**0.5 * USUAL_PAYLOAD_SHARE * EMPTY_KG, rel=0.05)


def test_runs_are_the_witnesses_not_their_batches() -> None:
    """Many batches of one run repeat its error: they vouch for it no more often than a few do."""
    few, many = shown_by((40.0, -40.0), 3), shown_by((40.0, -40.0), 300)
    assert many.model_std[0] == pytest.approx(few.model_std[0], rel=0.05)


@pytest.mark.parametrize("gross_kg", [-613.0, 2000.0])
def test_one_gross_error_says_little_of_the_model(gross_kg: float) -> None:
    """Of a load that was weighed wrong by hundreds of kilograms the intervals of all others must not be useless."""
    sound, one = shown_by(SOUND_KG), shown_by((*SOUND_KG, gross_kg))
    assert sound.model_std[0] < one.model_std[0] < 3.0 * sound.model_std[0]
    assert one.spread[0] < 1.5


def test_two_gross_errors_vouch_for_one_another() -> None:
    one, two = shown_by((*SOUND_KG, 600.0)), shown_by((*SOUND_KG, 600.0, -620.0))
    assert two.model_std[0] > 3.0 * one.model_std[0]


def test_an_unknown_place_says_nothing_and_hides_nothing() -> None:
    without = shown_by(SOUND_KG)
    assert without.model_std[2] == ModelErrors.usual(EMPTY_KG, STATED).model_std[2]
    unstated = [
        LeftOut("none", np.array([np.nan, np.nan]), np.zeros(2), Posterior(np.zeros(2), np.eye(2)), 0.0, 1.0, True)
    ]
    assert model_errors_shown_by([*left_out(SOUND_KG), *unstated], STATED, EMPTY_KG).model_std == without.model_std
