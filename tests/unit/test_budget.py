"""The budget of an error: its lines make up the whole, and what is offered narrows it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.budget import OWN, Remedy, budget_of, typical_budget
from gateway.posterior import CG_LEFT, FRONT_SHARE, PAYLOAD, SHAPE, Posterior, Source, exactly


def drawn(seed: int, size: int) -> Posterior:
    rng = np.random.default_rng(seed)
    scale = np.array([10.0, 0.4, 0.005])[:size]
    root = rng.standard_normal((size, size)) * scale[:, None]
    names = rng.permutation(list(Source))[: rng.integers(1, len(Source) + 1)]
    sources = {Source(name): rng.standard_normal((rng.integers(1, 4), size)) * scale for name in names}
    return Posterior(np.zeros(size), root @ root.T, sources)


posteriors = st.builds(drawn, st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 3]))


@given(posteriors, st.booleans(), st.booleans())
def test_squares_of_the_lines_add_up_to_the_variance(one: Posterior, said: bool, weighed: bool) -> None:
    lines = budget_of(one, is_shape_said=said, is_empty_weighed=weighed)
    assert sum(line.payload_kg**2 for line in lines) == pytest.approx(one.covariance[PAYLOAD, PAYLOAD])
    if one.size > FRONT_SHARE:
        assert sum(line.front_share_pct**2 for line in lines) == pytest.approx(one.covariance[FRONT_SHARE, FRONT_SHARE])
    else:
        assert all(math.isnan(line.front_share_pct) for line in lines)
    if one.size > CG_LEFT:
        assert sum(line.cg_left_m**2 for line in lines) == pytest.approx(one.covariance[CG_LEFT, CG_LEFT])
    else:
        assert all(math.isnan(line.cg_left_m) for line in lines)
    assert [line.payload_kg for line in lines] == sorted((line.payload_kg for line in lines), reverse=True)


@given(posteriors, st.booleans())
def test_a_remedy_is_narrower_than_today(one: Posterior, said: bool) -> None:
    for line in budget_of(one, is_shape_said=said):
        if line.remedy is None:
            assert math.isnan(line.payload_with_remedy_kg)
        else:
            assert 0.0 <= line.payload_with_remedy_kg <= one.std(PAYLOAD) + 1e-9


def with_all() -> Posterior:
    return Posterior(np.array([300.0, 50.0]), np.diag([36.0, 0.01]), {name: np.array([[20.0, 0.3]]) for name in Source})


def remedies(**known: bool) -> dict[str, Remedy | None]:
    return {line.source: line.remedy for line in budget_of(with_all(), **{"is_shape_said": False, **known})}


def test_each_source_has_the_remedy_that_helps_it() -> None:
    found = remedies()
    assert found[OWN] is Remedy.DRIVE_ON
    assert {found[name] for name in SHAPE} == {Remedy.SAY_WHAT_IS_CARRIED}
    assert found[Source.DAY] is found[Source.SENSOR] is Remedy.WEIGH_EMPTY
    assert found[Source.CALIBRATION] is Remedy.WEIGH_ONCE
    assert found[Source.EMPTY_SHARE] is Remedy.WEIGH_AXLES_EMPTY
    assert found[Source.SIDEWAYS] is Remedy.READ_ROLL_RATE


def test_nothing_is_offered_that_was_done() -> None:
    assert {remedies(is_shape_said=True)[name] for name in SHAPE} == {Remedy.WEIGH_ONCE}
    assert {remedies(is_empty_weighed=True)[name] for name in (Source.DAY, Source.SENSOR)} == {None}


def test_driving_on_leaves_a_third_of_what_is_the_batchs_own() -> None:
    (line,) = (line for line in budget_of(with_all(), is_shape_said=False) if line.source == OWN)
    assert line.payload_with_remedy_kg**2 == pytest.approx(with_all().covariance[0, 0] - 36.0 * 2.0 / 3.0)


def test_what_adds_nothing_has_no_line() -> None:
    assert budget_of(exactly(300.0, 50.0), is_shape_said=False) == ()
    quiet = Posterior(np.array([300.0, 50.0]), np.eye(2), {Source.DAY: np.zeros((3, 2))})
    assert [line.source for line in budget_of(quiet, is_shape_said=False)] == [OWN]


def test_several_batches_have_the_root_mean_squares_of_their_lines() -> None:
    """A source that one batch lacks counts as nothing there, so that squares still add up to the mean variance."""
    both, one = with_all(), with_all().without(Source.SIDEWAYS)
    together = typical_budget([budget_of(each, is_shape_said=True) for each in (both, one)])
    variance = 0.5 * (both.covariance + one.covariance)
    assert sum(line.payload_kg**2 for line in together) == pytest.approx(variance[PAYLOAD, PAYLOAD])
    by_source = {line.source: line for line in together}
    assert by_source[Source.SIDEWAYS].payload_kg == pytest.approx(20.0 / math.sqrt(2.0))
    assert by_source[Source.SIDEWAYS].remedy is Remedy.READ_ROLL_RATE
    assert together[0].payload_kg == max(line.payload_kg for line in together)
