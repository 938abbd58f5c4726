"""An estimate and its JSON object say the same, in both directions."""

import json
import unittest.mock
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.estimates.as_json import COLUMNS, FIELDS, estimate_from_json, estimate_to_json
from gateway.estimates.batch_estimate import PLACES, Epoch, Estimate, Lack, Quantity, Weight, Weights
from gateway.estimates.budget import BudgetLine, Remedy
from gateway.estimates.posterior import Posterior, Source
from gateway.records import Spectra, Why, json_line

numbers = st.floats(allow_infinity=False)
whole_ns = st.integers(0, 4_000_000_000_000_000_000)
names = st.text(min_size=1, max_size=8)
quantities = st.builds(Quantity, numbers, numbers, st.tuples(numbers, numbers))
by_name = st.dictionaries(names, numbers, max_size=3)
spectra = st.integers(0, 4).map(lambda n: Spectra(*(np.linspace(0.1 * k, np.pi, n) for k in range(5))))
weights = st.builds(Weight, numbers, numbers, st.none() | st.floats(1.0, 1e6), st.none() | st.sampled_from(Lack))
stds = st.floats(0.0, 1e6) | st.just(float("nan"))
lines = st.builds(
    BudgetLine, st.sampled_from(["own", *Source]), stds, stds, stds, st.none() | st.sampled_from(Remedy), stds
)
budgets = st.lists(lines, max_size=3).map(tuple)


@st.composite
def posteriors(draw: st.DrawFn) -> Posterior:
    size = draw(st.integers(1, 3))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    sources = {
        name: rng.normal(0.0, 20.0, (draw(st.integers(1, 9)), size)) for name in draw(st.sets(st.sampled_from(Source)))
    }
    root = rng.normal(0.0, 50.0, (size, size))
    return Posterior(rng.normal(0.0, 300.0, size), root @ root.T + np.eye(size), sources, (1.2, 2.6))


estimates = st.builds(
    Estimate,
    whole_ns,
    whole_ns,
    names,
    st.none() | names,
    quantities,
    quantities,
    *[numbers] * 7,
    by_name,
    st.lists(st.sampled_from(Why), max_size=3).map(tuple),
    st.booleans(),
    st.just(False),  # what is no batch has no JSON
    st.none() | spectra,
    by_name,
    st.none() | st.builds(Epoch, quantities, quantities, st.integers(1, 10**6), quantities),
    st.none() | posteriors(),
    budgets,
    st.none() | names,
    st.none() | names,
    quantities,
    quantities,
    *[numbers] * 2,
    st.builds(Weights, *[st.just(Weight()) | weights] * len(PLACES)),
)
OF_THE_LOAD = (
    "payload",
    "front_share",
    "payload_front_share_correlation",
    "cg_left",
    "left_share",
    "roll_share_front",
    "roll_share_front_std",
    "payload_cg_left_correlation",
    "front_share_cg_left_correlation",
)


FOLLOWING = {one.name for one in FIELDS if "correlation" in one.name}


def read_back(told: dict[str, Any]) -> Estimate:
    return estimate_from_json(json.loads(json_line(told)))


@given(estimates)
def test_a_read_estimate_is_written_identically(estimate: Estimate) -> None:
    told = estimate_to_json(estimate)
    again = estimate_to_json(read_back(told))
    assert again.keys() == told.keys()
    for name, x in told.items():
        if name in FOLLOWING and x is not None:  # from the posterior, which was rounded
            assert again[name] == pytest.approx(x, rel=1e-4, abs=1e-4)
        else:
            assert json_line({name: again[name]}) == json_line({name: x})


@given(posteriors())
def test_a_posterior_is_read_back_to_seven_digits(posterior: Posterior) -> None:
    again = read_back(estimate_to_json(Estimate(0, 1, "x", posterior=posterior))).posterior
    assert again.mean == pytest.approx(posterior.mean, rel=1e-8)
    std = np.sqrt(np.diag(posterior.covariance))  # a covariance may cancel: its digits are those of the deviations
    assert np.diag(again.covariance) == pytest.approx(std**2, rel=1e-5, abs=1e-5)
    assert again.covariance / np.outer(std, std) == pytest.approx(posterior.covariance / np.outer(std, std), abs=1e-5)
    assert again.sources.keys() == posterior.sources.keys()
    assert again.tails == posterior.tails
    assert again.leans == posterior.leans


@given(estimates, st.integers(0, 999))
def test_the_start_is_read_and_not_sought_by_hashes(estimate: Estimate, ns: int) -> None:
    """Up to a thousand hashes of an estimate found the nanoseconds again."""
    start_ns = 1_790_000_000_000_000_000 + ns
    told = estimate_to_json(replace(estimate, t_start_ns=start_ns))
    with unittest.mock.patch("gateway.estimates.batch_estimate.hashlib.sha256", side_effect=AssertionError("a hash")):
        assert read_back(told).t_start_ns == start_ns
        del told["t_start_ns"]
        assert read_back(told).t_start_ns == 1_790_000_000_000_000_000


@given(estimates, st.sampled_from(Why))
def test_a_refused_batch_has_no_numbers_of_the_load(estimate: Estimate, why: Why) -> None:
    told = estimate_to_json(estimate.refused(why))
    of_the_load = [one for one in FIELDS if one.path.split(".")[0] in OF_THE_LOAD]
    assert len(of_the_load) == 17
    assert {told[one.name] for one in of_the_load} == {None}
    refused = estimate_to_json(estimate.refused(why))
    assert "posterior" not in refused
    assert refused["error_budget"] == []
    assert told["rejected"] == [str(why)]


def test_no_name_is_given_twice() -> None:
    assert len({one.name for one in FIELDS}) == len(FIELDS)
    assert len(set(COLUMNS)) == len(COLUMNS)


def test_a_weight_is_over_its_limit_if_the_number_that_is_shown_is() -> None:
    """100000.76 kg are shown as 100000.8: a limit of 100000.78 is exceeded by what is shown, and stays so read back."""
    limited = Estimate(0, 1, "x", weights=Weights(gross=Weight(100_000.76, 1.0, 100_000.78, None)))
    told = estimate_to_json(limited)
    assert told["weights"]["gross"]["is_over_limit"]
    assert json_line(estimate_to_json(read_back(told))) == json_line(told)
