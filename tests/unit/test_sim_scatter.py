"""Vans drawn about a type."""

import numpy as np
import pytest

from benchmarks.accuracy.scatter import FROM_DAY_TO_DAY, OF_TYPES, Scatter, scattered
from gateway.sim.vans import PAPER_VAN


def test_no_scatter_is_the_type_itself() -> None:
    assert scattered(PAPER_VAN, Scatter(), np.random.default_rng(1)) == PAPER_VAN


def test_the_same_seed_draws_the_same_van_and_another_seed_another() -> None:
    one, again, other = (scattered(PAPER_VAN, OF_TYPES, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert one == again
    assert one != other


def test_properties_scatter_as_much_as_is_said_and_each_axle_alone() -> None:
    rng = np.random.default_rng(3)
    vans = [scattered(PAPER_VAN, FROM_DAY_TO_DAY, rng) for _ in range(1500)]
    front = np.log([van.front.damper.rebound_nspm / PAPER_VAN.front.damper.rebound_nspm for van in vans])
    rear = np.log([van.rear.damper.rebound_nspm / PAPER_VAN.rear.damper.rebound_nspm for van in vans])
    springs = np.log([van.rear.spring.rate_npm / PAPER_VAN.rear.spring.rate_npm for van in vans])
    assert front.std() == pytest.approx(0.05, rel=0.08)
    assert springs.std() == pytest.approx(0.015, rel=0.08)
    assert abs(np.corrcoef(front, rear)[0, 1]) < 0.1
    assert {van.sprung_kg for van in vans} == {PAPER_VAN.sprung_kg}


def test_a_heavier_van_is_a_larger_van() -> None:
    heavy = scattered(PAPER_VAN, Scatter(sprung=0.1), np.random.default_rng(7))
    factor = heavy.sprung_kg / PAPER_VAN.sprung_kg
    assert factor != 1.0
    assert heavy.pitch_inertia_kgm2 / PAPER_VAN.pitch_inertia_kgm2 == pytest.approx(factor)
    assert heavy.front.spring.rate_npm / PAPER_VAN.front.spring.rate_npm == pytest.approx(factor)
    assert heavy.rated_payload_kg / PAPER_VAN.rated_payload_kg == pytest.approx(factor)
    assert heavy.empty_front_share_pct == pytest.approx(PAPER_VAN.empty_front_share_pct)
