"""A posterior with its error by sources, and its budget: algebra held against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.estimates.budget import OWN, Remedy, budget_of, typical_budget
from gateway.estimates.posterior import (
    CG_LEFT,
    FRONT_SHARE,
    ONE_LOAD,
    PAYLOAD,
    SHAPE,
    Posterior,
    Source,
    difference,
    exactly,
    fused,
)
from gateway.estimates.quantity import Z95, Quantity

SCALE = np.array([10.0, 0.5, 0.01])  # kg, %, m


def drawn(seed: int, size: int = 3, sources: tuple[Source, ...] = tuple(Source)) -> Posterior:
    """Any posterior: correlated own errors, one to three columns a source."""
    rng = np.random.default_rng(seed)
    root = rng.standard_normal((size, size + 2)) * SCALE[:size, None]
    columns = {name: rng.standard_normal((int(rng.integers(1, 4)), size)) * SCALE[:size] for name in sources}
    return Posterior(rng.standard_normal(size) * 10.0 * SCALE[:size], root @ root.T, columns)


posteriors = st.builds(drawn, st.integers(0, 2**32 - 1), st.sampled_from([2, 3]))


@given(posteriors)
def test_the_covariance_is_that_of_own_and_of_every_column(one: Posterior) -> None:
    by_column = sum((np.outer(column, column) for columns in one.sources.values() for column in columns), one.own)
    assert one.covariance == pytest.approx(by_column)
    assert one.own + one.shared == pytest.approx(one.covariance)
    variance = np.diag(one.own) + sum(one.share_of(name) ** 2 for name in one.sources)
    assert variance == pytest.approx([one.std(i) ** 2 for i in range(one.size)])


SLOPES = st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=2)


@given(posteriors, SLOPES, SLOPES, st.floats(0.0, 20.0))
def test_a_linear_function_has_the_error_of_its_slopes(
    one: Posterior, slopes: list[float], others: list[float], beside: float
) -> None:
    found = one.linear(7.0, slopes, beside)
    whole, across = (np.r_[each, np.zeros(one.size - len(each))] for each in (slopes, others))
    assert found.number == 7.0
    assert found.std == pytest.approx(np.sqrt(whole @ one.covariance @ whole + beside**2), abs=1e-9)
    assert found.interval95 == pytest.approx((7.0 - Z95 * found.std, 7.0 + Z95 * found.std), abs=1e-6)
    assert one.covariance_of(slopes, others) == pytest.approx(whole @ one.covariance @ across, abs=1e-9)


def test_a_result_that_needs_an_unknown_place_is_unknown() -> None:
    one = drawn(3, size=2)
    found = one.linear(5.0, [1.0, 0.0, 2.0])
    assert found.number == 5.0
    assert np.isnan([found.std, *found.interval95]).all()
    assert one.linear(5.0, [1.0, 0.0, 0.0]) == one.linear(5.0, [1.0])
    assert np.isnan(one.quantity(CG_LEFT).number)
    assert np.isnan(one.std(CG_LEFT))
    assert np.isnan(one.correlation(PAYLOAD, CG_LEFT))


SKEWED = Posterior(
    np.array([300.0, 50.0]), np.diag([25.0, 0.01]), {Source.LOAD_LENGTH: np.array([[20.0, -0.2]])}, (1.2, 2.6)
)


def test_an_interval_is_as_skewed_as_the_error_of_the_shape() -> None:
    payload = SKEWED.quantity(PAYLOAD)
    below, above = 300.0 - payload.interval95[0], payload.interval95[1] - 300.0
    assert (below, above) == pytest.approx((np.hypot(Z95 * 5.0, 1.2 * 20.0), np.hypot(Z95 * 5.0, 2.6 * 20.0)))
    assert payload.std == pytest.approx(np.hypot(5.0, 20.0))
    low, high = SKEWED.quantity(FRONT_SHARE).interval95  # falls as the payload rises: the other way round
    assert (50.0 - low, high - 50.0) == pytest.approx((np.hypot(Z95 * 0.1, 2.6 * 0.2), np.hypot(Z95 * 0.1, 1.2 * 0.2)))


def test_the_payload_leans_and_other_quantities_as_far_as_they_follow_it() -> None:
    plain = Posterior(np.array([300.0, 50.0]), np.diag([25.0, 0.01]), {Source.DAY: np.array([[20.0, -0.2]])})
    leaning = replace(plain, leans=(1.1, 1.4))
    for quantity, follows in ((PAYLOAD, 1.0), (FRONT_SHARE, -plain.correlation(PAYLOAD, FRONT_SHARE))):
        number, half = plain.quantity(quantity).number, Z95 * plain.std(quantity)
        low, high = leaning.quantity(quantity).interval95
        found = (number - low) / half, (high - number) / half
        expected = 1.0 + 0.1 * follows**2, 1.0 + 0.4 * follows**2
        assert found == pytest.approx(expected if quantity == PAYLOAD else expected[::-1])
    assert fused([leaning, plain]).leans == pytest.approx((1.05, 1.2))


@given(st.lists(st.integers(0, 2**32 - 1), min_size=1, max_size=5))
def test_fusion_weighs_by_own_information(seeds: list[int]) -> None:
    parts = [drawn(seed) for seed in seeds]
    together = fused(parts)
    information = [np.linalg.inv(part.own) for part in parts]
    own = np.linalg.inv(sum(information, np.zeros((3, 3))))
    mean = own @ sum((each @ part.mean for each, part in zip(information, parts, strict=True)), np.zeros(3))
    assert together.own / np.outer(SCALE, SCALE) == pytest.approx(own / np.outer(SCALE, SCALE), rel=1e-5, abs=1e-8)
    assert together.mean / SCALE == pytest.approx(mean / SCALE, rel=1e-5, abs=1e-6)


@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), st.sampled_from([2, 3])), min_size=1, max_size=5), st.randoms())
def test_fusion_does_not_depend_on_the_order(drawn_of: list[tuple[int, int]], random: object) -> None:
    parts = [drawn(*each) for each in drawn_of]
    shuffled = parts.copy()
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    one, other = fused(parts), fused(shuffled)
    assert one.mean == pytest.approx(other.mean, rel=1e-6, abs=1e-6)
    assert one.covariance == pytest.approx(other.covariance, rel=1e-6, abs=1e-6)


def test_fusion_needs_a_batch_and_leaves_one_alone() -> None:
    one = drawn(9)
    assert fused([one]) is one
    assert fused([exactly(300.0)]) == exactly(300.0)  # whose own errors have no precision
    with pytest.raises(ValueError, match="no batch"):
        fused([])


def test_a_batch_without_a_place_narrows_the_others_through_their_correlation() -> None:
    three = Posterior(np.array([300.0, 50.0, 0.02]), np.array([[64.0, 0.0, 0.04], [0.0, 0.1, 0.0], [0.04, 0.0, 4e-5]]))
    two = Posterior(np.array([310.0, 50.0]), np.diag([64.0, 0.1]))
    together = fused([three, two])
    assert together.mean[PAYLOAD] == pytest.approx(305.0)
    assert together.std(CG_LEFT) < three.std(CG_LEFT)
    assert together.mean[CG_LEFT] == pytest.approx(0.02 + 0.04 / 64.0 * 5.0)  # moves along as the errors do


def of_sources(payload_kg: float, own_kg: float, **columns: float) -> Posterior:
    by_source = {Source[name]: np.array([[kg, 0.0]]) for name, kg in columns.items()}
    return Posterior(np.array([payload_kg, 50.0]), np.diag([own_kg**2, 0.01]), by_source)


def test_errors_that_grow_with_the_load_stay_proportional_to_the_change() -> None:
    one, other = (of_sources(kg, 6.0, CALIBRATION=0.1 * kg) for kg in (200.0, 260.0))
    _, covariance = difference(one, other, is_one_load=False)
    assert covariance[0, 0] == pytest.approx(2.0 * 36.0 + 6.0**2)


@pytest.mark.parametrize("name", sorted(ONE_LOAD))
def test_errors_of_one_load_are_shared_as_far_as_the_loads_are(name: Source) -> None:
    def variance(before_kg: float, after_kg: float, *, is_one_load: bool) -> float:
        pair = (of_sources(kg, 0.0, **{name.name: 10.0}) for kg in (before_kg, after_kg))
        return float(difference(*pair, is_one_load=is_one_load)[1][0, 0])

    assert variance(200.0, 260.0, is_one_load=True) == pytest.approx(0.0)
    assert variance(200.0, 200.0, is_one_load=False) == pytest.approx(0.0)
    assert variance(0.0, 200.0, is_one_load=False) == pytest.approx(200.0)
    assert variance(100.0, 200.0, is_one_load=False) == pytest.approx(100.0)


@given(posteriors, posteriors, st.booleans())
def test_a_difference_is_as_sure_in_either_direction(one: Posterior, other: Posterior, is_one_load: bool) -> None:
    there, back = (difference(*pair, is_one_load=is_one_load) for pair in ((one, other), (other, one)))
    assert there[0] == pytest.approx(-back[0])
    assert there[1] == pytest.approx(back[1], rel=1e-9, abs=1e-9)
    size = min(one.size, other.size)
    assert there[1].shape == (size, size)
    assert np.linalg.eigvalsh(there[1] / np.outer(SCALE[:size], SCALE[:size])).min() > -1e-9


@given(posteriors)
def test_two_batches_of_one_load_differ_by_their_own_errors_only(one: Posterior) -> None:
    assert difference(one, one, is_one_load=True)[1] == pytest.approx(2.0 * one.own)


def test_a_source_may_be_added_to_and_taken_away() -> None:
    one = drawn(7, sources=(Source.DAY,))
    more = one.with_source(Source.DAY, np.ones((1, 3))).with_source(Source.MODEL, np.eye(3))
    assert len(more.sources[Source.DAY]) == len(one.sources[Source.DAY]) + 1
    assert more.without(Source.MODEL, Source.DAY).covariance == pytest.approx(one.own)
    assert not one.share_of(Source.MODEL).any()


@pytest.mark.parametrize(
    "other",
    [drawn(2), drawn(1, 2), drawn(1, sources=(Source.DAY,)), Posterior(drawn(1).mean, drawn(1).own), "no posterior"],
)
def test_equality_is_of_numbers(other: object) -> None:
    assert drawn(1) == drawn(1)
    assert drawn(1) != other


def test_a_normal_interval_is_widened_in_quadrature() -> None:
    assert Quantity.normal(100.0, 3.0).widened(4.0).interval95 == pytest.approx((100.0 - 5.0 * Z95, 100.0 + 5.0 * Z95))
    assert Quantity.normal(100.0, 3.0).widened(4.0).std == pytest.approx(5.0)


def test_a_skewed_interval_stays_skewed() -> None:
    wide = Quantity(100.0, 10.0, (90.0, 130.0)).widened(8.0 / Z95)
    assert (100.0 - wide.interval95[0], wide.interval95[1] - 100.0) == pytest.approx((164.0**0.5, 964.0**0.5))
    assert wide.number == 100.0


def budget_drawn(seed: int, size: int) -> Posterior:
    rng = np.random.default_rng(seed)
    scale = np.array([10.0, 0.4, 0.005])[:size]
    root = rng.standard_normal((size, size)) * scale[:, None]
    names = rng.permutation(list(Source))[: rng.integers(1, len(Source) + 1)]
    sources = {Source(name): rng.standard_normal((rng.integers(1, 4), size)) * scale for name in names}
    return Posterior(np.zeros(size), root @ root.T, sources)


budgets = st.builds(budget_drawn, st.integers(0, 2**32 - 1), st.sampled_from([1, 2, 3]))


@given(budgets, st.booleans(), st.booleans())
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


@given(budgets, st.booleans(), st.booleans())
def test_a_remedy_is_narrower_than_today(one: Posterior, said: bool, weighed: bool) -> None:
    for line in budget_of(one, is_shape_said=said, is_empty_weighed=weighed):
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
    assert found[Source.MODEL] is None
    assert found[Source.EMPTY_SHARE] is Remedy.WEIGH_AXLES_EMPTY
    assert found[Source.SIDEWAYS] is Remedy.READ_ROLL_RATE


def test_a_remedy_that_was_applied_is_not_offered_again() -> None:
    assert {remedies(is_shape_said=True)[name] for name in SHAPE} == {None}
    assert {remedies(is_empty_weighed=True)[name] for name in (Source.DAY, Source.SENSOR)} == {None}


def test_driving_on_leaves_a_third_of_the_batchs_own_error() -> None:
    (line,) = (line for line in budget_of(with_all(), is_shape_said=False) if line.source == OWN)
    assert line.payload_with_remedy_kg**2 == pytest.approx(with_all().covariance[0, 0] - 36.0 * 2.0 / 3.0)


def test_a_scale_leaves_the_errors_of_the_model_and_of_the_day() -> None:
    """It tells of the vehicle's parameters. What the model neglects differs from load to load."""
    (line,) = (line for line in budget_of(with_all(), is_shape_said=False) if line.source == Source.CALIBRATION)
    assert line.payload_with_remedy_kg**2 == pytest.approx(with_all().covariance[0, 0] - 20.0**2)


def test_a_source_without_error_has_no_line() -> None:
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
