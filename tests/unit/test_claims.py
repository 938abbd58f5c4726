"""Words on one payload in the fit: what they say together, and what a drive says without one of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.half_car_road import VAN

from gateway.calibration.statements import (
    NOTHING_KNOWN,
    Claim,
    Statement,
    Terms,
    common_causes,
    load_prior_of,
    shared_disagreement,
)
from gateway.estimates.quantity import Z95
from gateway.records import F64

KG = st.floats(0.0, 600.0)
PLUS_MINUS = st.floats(2.0, 80.0)


def claim(name: str, payload_kg: float, plus_minus_kg: float, **shared: float) -> Claim:
    return Claim(name=name, payload_kg=payload_kg, plus_minus_kg=plus_minus_kg, shared=tuple(shared.items()))


def together(prior: tuple[F64, F64], terms: Terms) -> tuple[F64, F64]:
    """The posterior of payload and causes by Bayes' rule, from a Gaussian prior."""
    mean, covariance = prior
    rows = terms.rows
    precision = np.linalg.inv(covariance) + rows.T @ rows
    pull = np.linalg.solve(covariance, mean) + rows.T @ (terms.said_kg / terms.own_kg)
    return np.linalg.solve(precision, pull), np.linalg.inv(precision)


@given(KG, PLUS_MINUS, KG, PLUS_MINUS, KG, st.floats(5.0, 100.0), st.floats(0.0, 30.0))
def test_removing_a_claim_restores_the_earlier_posterior(
    one_kg: float, one: float, other_kg: float, other: float, drive_kg: float, drive_std: float, shared: float
) -> None:
    claims = [claim("a", one_kg, one, note=shared), claim("b", other_kg, other, note=0.5 * shared)]
    terms = Terms.of(claims, ("note",))
    drive = np.array([drive_kg, 0.0]), np.diag([drive_std**2, 1.0])
    posterior = together(drive, terms)
    mean, covariance = terms.without(*posterior, [0, 1])
    np.testing.assert_allclose(mean, drive[0], atol=1e-4 * (drive_kg + 100.0))
    np.testing.assert_allclose(covariance, drive[1], rtol=1e-4, atol=1e-6)
    by_other = together(drive, Terms.of(claims[1:], ("note",)))
    for found, expected in zip(terms.without(*posterior, [0]), by_other, strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-3)


@given(KG, PLUS_MINUS, KG, PLUS_MINUS)
def test_two_claims_on_one_load_equal_one_with_their_combined_precision(
    one_kg: float, one: float, other_kg: float, other: float
) -> None:
    prior = np.array([250.0]), np.array([[90.0**2]])
    both = together(prior, Terms.of([claim("a", one_kg, one), claim("b", other_kg, other)], ()))
    said = Statement().saying([claim("a", one_kg, one), claim("b", other_kg, other)])
    assert said.payload_kg is not None
    single = together(prior, Terms.of([claim("c", said.payload_kg, said.payload_plus_minus_kg)], ()))
    np.testing.assert_allclose(both[0], single[0])
    np.testing.assert_allclose(both[1], single[1])
    swapped = together(prior, Terms.of([claim("b", other_kg, other), claim("a", one_kg, one)], ()))
    np.testing.assert_allclose(both[0], swapped[0])


def test_a_cause_counts_as_common_if_two_claims_have_it() -> None:
    claims = [claim("a", 1.0, 1.0, note=1.0, lone=2.0), claim("b", 2.0, 1.0, note=3.0)]
    assert common_causes(claims) == ("note",)
    terms = Terms.of(claims, ("note",))
    np.testing.assert_allclose(terms.shared_kg, [[1.0], [3.0]])
    np.testing.assert_allclose(terms.own_kg, [np.hypot(1.0 / Z95, 2.0), 1.0 / Z95])


@given(st.floats(-5.0, 5.0), st.floats(0.05, 3.0))
def test_a_common_cause_is_tested_as_a_claim_is(seen: float, std: float) -> None:
    """The drives say the cause is ``seen`` +- std, its prior N(0, 1)."""
    variance = 1.0 / (1.0 + std**-2.0)
    mean = variance * seen / std**2
    assert shared_disagreement(mean, variance) == pytest.approx(abs(seen) / np.hypot(std, 1.0), rel=1e-6, abs=1e-9)


def test_the_truth_is_the_claims_without_their_common_error() -> None:
    terms = Terms.of([claim("a", 270.0, 10.0, note=15.0), claim("b", 180.0, 10.0, note=10.0)], ("note",))
    one, other = (
        Terms(("x",), *(part[[i]] for part in (terms.said_kg, terms.own_kg, terms.shared_kg))) for i in (0, 1)
    )
    causes, covariance = np.array([2.0]), np.array([[0.0]])
    assert one.truth(causes, covariance)[0] == pytest.approx(300.0)
    assert other.truth(causes, covariance)[0] == pytest.approx(200.0)
    assert one.truth(causes, np.array([[1.0]]))[1] == pytest.approx(np.hypot(10.0 / Z95, 15.0))


def test_disbelieved_claims_leave_the_others() -> None:
    both = Statement(position_m=1.2, placed_by="b").saying([claim("a", 300.0, 25.0), claim("b", 310.0, 12.0)])
    left = both.without("b")
    assert (left.payload_kg, left.position_m, [one.name for one in left.claims]) == (300.0, None, ["a"])
    assert both.without("a").position_m == 1.2
    assert left.without("a") == NOTHING_KNOWN
    assert load_prior_of(NOTHING_KNOWN, VAN).payload_std_kg > 100.0


def test_a_claim_of_less_weight_keeps_its_shared_error() -> None:
    soft = claim("a", 300.0, 10.0, a=20.0, note=15.0).softened(2.0)
    assert (soft.plus_minus_kg, dict(soft.shared)) == (20.0, {"a": 40.0, "note": 15.0})
