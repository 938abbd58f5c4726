"""The shape of a load: what is believed of it, and that it is a hypothesis held against every mass."""

from dataclasses import replace
from math import exp, log

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.cargo import (
    BODY_MASS_PART,
    FLOOR_BELOW_BODY_M,
    ROOF_ABOVE_FLOOR_LOAD_M,
    Carries,
    ShapePrior,
    is_said,
    shape_prior,
)
from gateway.core.cross_spectrum.shape import (
    EVIDENCE_DOF,
    NODES_PER_WHEELBASE2,
    SHAPE_EVIDENCE,
    Node,
    Shaped,
    Waypoint,
    shaped,
)
from gateway.core.vehicle import Vehicle
from gateway.posterior import NORMAL_TAILS
from gateway.records import F64

VAN = Vehicle(name="van", empty_mass_kg=1240.0, wheelbase_m=2.8, sensor_position_m=0.0)
KNOWN_S_M2 = 0.07  # a box of 0.8 m by 0.5 m


def believed(**said: object) -> ShapePrior:
    return shape_prior(replace(VAN, **said), KNOWN_S_M2, 0.2)  # type: ignore[arg-type] # any field


statements = st.fixed_dictionaries(
    {},
    optional={
        "payload_length_m": st.floats(0.3, 4.0),
        "payload_height_m": st.floats(0.2, 2.0),
        "carries": st.sampled_from(Carries),
        "roof_rack": st.booleans(),
        "tow_bar": st.booleans(),
        "wheelbase_m": st.floats(2.2, 4.5),
    },
)


@given(statements)
def test_probabilities_add_up_to_one(said: dict[str, object]) -> None:
    found = believed(**said)
    assert found.probability.sum() == pytest.approx(1.0)
    assert found.probability.min() >= 0.0
    assert np.all(np.diff(found.log_s) > 0.0)
    assert found.variance > 0.0
    assert 0.0 <= found.habit <= 1.0


@given(st.floats(0.3, 3.5), st.floats(1.05, 1.5))
def test_a_longer_statement_moves_its_mean_up(length_m: float, factor: float) -> None:
    short, long = (believed(payload_length_m=each) for each in (length_m, factor * length_m))
    assert long.mean > short.mean


def test_a_higher_statement_moves_its_mean_up() -> None:
    low, high = (believed(payload_length_m=1.2, payload_height_m=each) for each in (0.5, 1.4))
    assert high.mean > low.mean


def test_s_of_a_box_by_hand() -> None:
    """2 m long and 1 m high on a floor 0.15 m below the body's centre: its own centre lies 0.35 m above that."""
    by_hand = (2.0**2 + 1.0**2) / 12.0 + 0.8 * 0.35**2
    assert (FLOOR_BELOW_BODY_M, BODY_MASS_PART) == (0.15, 0.8)
    found = believed(payload_length_m=2.0, payload_height_m=1.0)
    assert exp(found.mean) == pytest.approx(by_hand, rel=0.05)
    median = np.interp(0.5, np.cumsum(found.probability), found.log_s)
    assert exp(median) == pytest.approx(by_hand, rel=0.05)


def test_what_is_stated_is_known_better_than_what_is_not() -> None:
    unsaid, said = believed(), believed(payload_length_m=0.8, payload_height_m=0.5)
    assert said.variance < 0.5 * unsaid.variance
    assert (is_said(VAN), is_said(replace(VAN, payload_length_m=0.8))) == (False, True)
    assert (is_said(replace(VAN, carries=Carries.MIXED)), is_said(replace(VAN, carries=Carries.PARCELS))) == (
        False,
        True,
    )


def test_what_nobody_said_is_half_like_the_known_loads_and_half_longer() -> None:
    """Two humps: the known loads' shape has its share, and loads all over the floor have theirs."""
    found = believed()
    near_known = found.probability[np.abs(found.log_s - log(KNOWN_S_M2)) < 0.9].sum()
    long = found.probability[found.log_s > log(0.3)].sum()
    assert 0.35 < near_known < 0.65
    assert 0.25 < long < 0.6


def test_goods_are_in_order_of_their_length() -> None:
    means = {kind: believed(carries=kind).mean for kind in Carries}
    assert means[Carries.PALLETS] < means[Carries.PARCELS] < means[Carries.LONG_GOODS]


def test_a_floor_is_as_long_as_its_vehicle() -> None:
    small, large = (believed(carries=Carries.PARCELS, wheelbase_m=each) for each in (2.4, 4.0))
    assert large.mean - small.mean == pytest.approx(2.0 * log(4.0 / 2.4), abs=0.4)


@pytest.mark.parametrize("where", ["roof_rack", "tow_bar"])
def test_a_rack_or_a_tow_bar_makes_larger_shapes_likely(where: str) -> None:
    without, with_it = believed(payload_length_m=1.0), believed(payload_length_m=1.0, **{where: True})
    assert with_it.mean > without.mean
    far = log(1.0 / 12.0 + 0.5 * 0.24 * ROOF_ABOVE_FLOOR_LOAD_M**2)
    assert with_it.probability[with_it.log_s > far].sum() > without.probability[without.log_s > far].sum()


WHEELBASE_M = 2.8
MEAN, STD = log(0.06 * WHEELBASE_M**2), 0.5  # of log s before the batch
LOG_S = np.linspace(MEAN - 2.5, MEAN + 2.5, 401)
SLOPE = np.array([60.0, -0.01])  # kg and 0..1 for each unit of log s


def gaussian() -> ShapePrior:
    density = np.exp(-0.5 * ((LOG_S - MEAN) / STD) ** 2)
    return ShapePrior(LOG_S, density / density.sum(), habit=0.5)


def weighed(evidence: float, best: float, std: float, prior: ShapePrior | None = None) -> Shaped:
    """A cost that is quadratic about ``best``, and a load that is linear in log s; one more number before the load."""

    def weighed_as(log_s: float, start: F64) -> Node:
        x = np.r_[log_s - MEAN, 300.0 + SLOPE[0] * (log_s - MEAN), 0.5 + SLOPE[1] * (log_s - MEAN)]
        return Node(Waypoint(log_s, x, np.r_[1.0, SLOPE]), 0.5 * ((log_s - best) / std) ** 2, x, own_std_kg=1.0)

    start = log(NODES_PER_WHEELBASE2[2] * WHEELBASE_M**2)
    return shaped(prior or gaussian(), WHEELBASE_M, Waypoint(start, np.zeros(3), np.zeros(3)), weighed_as, evidence)


def test_without_evidence_the_prior_is_left() -> None:
    found = weighed(0.0, MEAN + 1.0, 0.3)
    assert found.log_s == pytest.approx(MEAN, abs=0.01)
    assert found.load == pytest.approx([300.0, 0.5], abs=0.6)
    assert found.column == pytest.approx(STD * SLOPE, rel=0.02)
    assert found.tails == pytest.approx(NORMAL_TAILS, rel=0.03)
    assert found.goods_part == pytest.approx(0.5, rel=0.05)


@pytest.mark.parametrize("evidence", [0.2, 1.0])
def test_the_posterior_is_the_prior_times_students_likelihood(evidence: float) -> None:
    """By quadrature on a fine grid: nodes and interpolation cost no more than a few percent."""
    best, std = MEAN + 0.4, 0.6
    log_s = np.linspace(MEAN - 2.5, MEAN + 2.5, 4001)
    distance2 = SHAPE_EVIDENCE * evidence * ((log_s - best) / std) ** 2
    weight = np.exp(-0.5 * ((log_s - MEAN) / STD) ** 2)
    weight *= (1.0 + distance2 / EVIDENCE_DOF) ** (-0.5 * (EVIDENCE_DOF + 1.0))
    weight /= weight.sum()
    mean = float(weight @ log_s)
    median = float(np.interp(0.5, np.cumsum(weight), log_s))
    found = weighed(evidence, best, std)
    assert found.log_s == pytest.approx(mean, abs=0.02)
    assert found.load == pytest.approx(np.array([300.0, 0.5]) + SLOPE * (median - MEAN), rel=0.01)
    assert found.column == pytest.approx(SLOPE * np.sqrt(weight @ (log_s - mean) ** 2), rel=0.05)
    assert found.x[0] == pytest.approx(mean - MEAN, abs=0.02)


@pytest.mark.parametrize("evidence", [0.25, 0.5, 1.0])
def test_a_shape_that_one_batch_speaks_against_stays_possible(evidence: float) -> None:
    """Two kinds of load, equally likely before; the half-car may err, so the odds fall by a power and not by exp."""
    compact, long, std = MEAN - 0.8, MEAN + 0.8, 0.4
    lumps = sum(np.exp(-0.5 * ((LOG_S - at) / 0.03) ** 2) for at in (compact, long))
    found = weighed(evidence, compact, std, ShapePrior(LOG_S, lumps / lumps.sum(), 0.5))
    part = (found.log_s - compact) / (long - compact)
    distance2 = SHAPE_EVIDENCE * evidence * ((long - compact) / std) ** 2
    assert part / (1.0 - part) == pytest.approx(
        (1.0 + distance2 / EVIDENCE_DOF) ** (-0.5 * (EVIDENCE_DOF + 1.0)), rel=0.1
    )


def test_what_the_evidence_leaves_is_less_of_a_habit() -> None:
    vague, sure = weighed(0.1, MEAN, 0.6), weighed(1.0, MEAN, 0.2)
    assert 0.0 < sure.goods_part < vague.goods_part <= 0.5


def test_the_column_says_how_payload_and_share_go_together() -> None:
    found = weighed(1.0, MEAN, 0.5)
    assert found.column[1] / found.column[0] == pytest.approx(SLOPE[1] / SLOPE[0], rel=0.01)


def test_a_skewed_prior_gives_skewed_tails() -> None:
    """Most loads are compact, some are much longer."""
    compact, long = (np.exp(-0.5 * ((LOG_S - at) / 0.3) ** 2) for at in (MEAN - 0.6, MEAN + 0.9))
    density = 0.8 * compact + 0.2 * long
    found = weighed(0.0, MEAN, 1.0, ShapePrior(LOG_S, density / density.sum(), 0.5))
    below, above = found.tails
    assert above > 1.3 * below
    drawn = np.random.default_rng(1).choice(LOG_S, 200_000, p=density / density.sum())
    error = (drawn - np.median(drawn)) / drawn.std()
    assert (-below, above) == pytest.approx(tuple(np.quantile(error, [0.025, 0.975])), abs=0.1)


def test_a_shape_that_is_known_leaves_nothing_open() -> None:
    narrow = np.exp(-0.5 * ((LOG_S - MEAN) / 0.02) ** 2)
    found = weighed(1.0, MEAN, 0.5, ShapePrior(LOG_S, narrow / narrow.sum(), 0.5))
    assert np.abs(found.column[0]) < 0.05 * SLOPE[0]
    assert found.log_s == pytest.approx(MEAN, abs=0.02)
