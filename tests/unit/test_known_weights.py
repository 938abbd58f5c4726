"""Known weights condition the sources of error: held against the Kalman filter's closed forms and against laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.core.known_weights import CONTRADICTED, DAY_MEMORY_S, Knowledge, Observation
from gateway.posterior import ONE_LOAD, PAYLOAD, Posterior, Source
from gateway.units import NS_PER_S

T_NS = 1_790_000_000 * NS_PER_S
ID, BY = "sha256:ab", "cross_spectrum"


def weighed(payload_kg: float, own_kg: float = 5.0, **columns_kg: float) -> Posterior:
    """A posterior with one column a source, of the payload alone."""
    by_source = {Source[name]: np.array([[kg, 0.0]]) for name, kg in columns_kg.items()}
    return Posterior(np.array([payload_kg, 50.0]), np.diag([own_kg**2, 0.04]), by_source)


def observed(
    posterior: Posterior, truth_kg: float, std_kg: float = 3.0, t_ns: int = T_NS, name: str = "a"
) -> Observation:
    return Observation(name, t_ns, ID, BY, posterior, np.array([truth_kg]), np.array([[std_kg**2]]))


def knowing(*observations: Observation) -> Knowledge:
    known = Knowledge.of(observations)
    assert known is not None
    return known


def test_one_known_weight_narrows_as_the_kalman_filter_has_it() -> None:
    """z ~ N(0, 1), seen as 40 z + noise of 5 and 3 kg: gain 40 / (40^2 + 34), variance 34 / (40^2 + 34)."""
    known = knowing(observed(weighed(330.0, CALIBRATION=40.0), 300.0))
    noise = 5.0**2 + 3.0**2
    mean, variance = 40.0 * 30.0 / (40.0**2 + noise), noise / (40.0**2 + noise)
    later = known.applied(weighed(150.0, CALIBRATION=20.0), T_NS)
    assert later.mean.tolist() == pytest.approx([150.0 - 20.0 * mean, 50.0])
    assert later.own == pytest.approx(weighed(150.0).own)
    assert later.covariance[0, 0] == pytest.approx(5.0**2 + 20.0**2 * variance)


def test_it_solves_the_regression_of_what_was_seen() -> None:
    """Several observations of several sources: the posterior of z by the normal equations of all of them at once."""
    rng = np.random.default_rng(1)
    columns = rng.normal(0.0, 10.0, (4, 5, 2)) * [1.0, 0.02]  # 4 observations of 5 causes
    truth, noise = np.array([300.0, 48.0]), np.diag([9.0, 0.01])
    seen = []
    for i, each in enumerate(columns):
        posterior = Posterior(
            truth + np.array([12.0, -0.3]),
            np.diag([25.0, 0.04]),
            {Source.CALIBRATION: each[:3], Source.SENSOR: each[3:]},
        )
        seen.append(Observation(str(i), T_NS + i, ID, BY, posterior, truth, noise))
    known = knowing(*seen)
    weight = np.linalg.inv(np.diag([25.0, 0.04]) + noise)
    information = np.eye(5) + sum(each @ weight @ each.T for each in columns)
    pull = sum(each @ weight @ np.array([12.0, -0.3]) for each in columns)
    assert known.covariance == pytest.approx(np.linalg.inv(information))
    assert known.mean == pytest.approx(np.linalg.solve(information, pull))


@pytest.mark.parametrize("name", sorted(ONE_LOAD))
def test_what_lasts_for_one_load_is_noise_of_the_observation(name: Source) -> None:
    known = knowing(observed(weighed(330.0, CALIBRATION=40.0, **{name.name: 12.0}), 300.0))
    later = known.applied(weighed(150.0, CALIBRATION=20.0, **{name.name: 12.0}), T_NS)
    noise = 5.0**2 + 3.0**2 + 12.0**2
    assert later.covariance[0, 0] == pytest.approx(5.0**2 + 12.0**2 + 20.0**2 * noise / (40.0**2 + noise))
    assert later.sources[name].tolist() == [[12.0, 0.0]]


lasting = st.sampled_from([Source.CALIBRATION, Source.GOODS, Source.SENSOR, Source.EMPTY_SHARE])
seen = st.builds(
    lambda name, kg, off, truth: observed(weighed(truth + off, **{name.name: kg}), truth, name=f"{name}{kg}{off}"),
    lasting,
    st.floats(-60.0, 60.0),
    st.floats(-50.0, 50.0),
    st.floats(0.0, 500.0),
)


@given(st.lists(seen, min_size=1, max_size=5, unique_by=lambda one: one.id), st.randoms())
def test_without_the_days_sources_time_and_order_do_not_matter(observations: list[Observation], random: object) -> None:
    at_any_time = [
        Observation(one.id, T_NS + i * 86_400 * NS_PER_S, ID, BY, one.posterior, one.truth, one.truth_covariance)
        for i, one in enumerate(observations)
    ]
    shuffled = observations.copy()
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    one, other = knowing(*at_any_time), knowing(*shuffled)
    assert one.mean == pytest.approx(other.mean, abs=1e-6)
    assert one.covariance == pytest.approx(other.covariance, abs=1e-6)


@given(st.lists(seen, min_size=2, max_size=5, unique_by=lambda one: one.id))
def test_more_known_weights_never_know_less(observations: list[Observation]) -> None:
    of_all = knowing(*observations)
    of_one = knowing(observations[0])
    for name, place in of_one.slots.items():
        before, after = of_one.covariance[place, place], of_all.covariance[of_all.slots[name], of_all.slots[name]]
        assert np.linalg.eigvalsh(before - after).min() > -1e-9


def test_what_is_known_of_the_day_is_forgotten() -> None:
    known = knowing(observed(weighed(330.0, DAY=40.0), 300.0))
    std_kg, moved_kg = [], []
    for days in (0.0, 1.0, 3.0, 30.0):
        later = known.applied(weighed(150.0, DAY=20.0), T_NS + round(days * 86_400 * NS_PER_S))
        std_kg.append(later.std(PAYLOAD))
        moved_kg.append(150.0 - later.mean[0])
    assert std_kg == sorted(std_kg)
    assert moved_kg == sorted(moved_kg, reverse=True)
    assert std_kg[-1] == pytest.approx(np.hypot(5.0, 20.0), rel=1e-6)
    after = np.exp(-3.0 * 86_400 / DAY_MEMORY_S)
    assert moved_kg[2] == pytest.approx(moved_kg[0] * after)
    noise = 34.0 / (40.0**2 + 34.0)
    assert std_kg[2] ** 2 - 25.0 == pytest.approx(20.0**2 * (1.0 - after**2 * (1.0 - noise)))


def test_what_lasts_is_not_forgotten() -> None:
    known = knowing(observed(weighed(330.0, CALIBRATION=40.0), 300.0))
    stds = {
        known.applied(weighed(150.0, CALIBRATION=20.0), T_NS + days * 86_400 * NS_PER_S).std(0) for days in (0, 900)
    }
    assert len(stds) == 1


def test_taking_one_back_restores_every_bit() -> None:
    first, second = (observed(weighed(330.0, CALIBRATION=40.0, DAY=9.0), kg, name=str(kg)) for kg in (300.0, 310.0))
    alone, both = knowing(first), knowing(first, second)
    again = knowing(*[one for one in (first, second) if one is not second])
    posterior = weighed(150.0, CALIBRATION=20.0, DAY=5.0)
    assert again.applied(posterior, T_NS) == alone.applied(posterior, T_NS)
    assert again.id == alone.id != both.id
    assert Knowledge.of([]) is None


def test_an_exact_truth_moves_an_error_of_the_sources_alone_to_it() -> None:
    off = weighed(330.0, own_kg=0.0, CALIBRATION=40.0, SENSOR=10.0)
    known = knowing(observed(off, 300.0, std_kg=1e-6))
    again = known.applied(off, T_NS)
    assert again.mean[PAYLOAD] == pytest.approx(300.0)
    assert again.std(PAYLOAD) == pytest.approx(0.0, abs=1e-3)


def test_an_empty_vehicle_teaches_nothing_of_what_moves_only_loads() -> None:
    known = knowing(observed(weighed(12.0, CALIBRATION=0.0, DAY=10.0), 0.0))
    later = known.applied(weighed(300.0, CALIBRATION=40.0, DAY=10.0), T_NS)
    assert np.abs(later.sources[Source.CALIBRATION][:, 0]) == pytest.approx([40.0])
    assert later.mean[PAYLOAD] == pytest.approx(300.0 - 12.0 * 100.0 / (100.0 + 34.0))


def test_axle_weights_teach_the_front_share_too() -> None:
    column = np.array([[0.0, 0.5]])
    posterior = Posterior(np.array([300.0, 49.0]), np.diag([25.0, 0.01]), {Source.EMPTY_SHARE: column})
    one = Observation("a", T_NS, ID, BY, posterior, np.array([300.0, 48.5]), np.diag([9.0, 0.01]))
    later = knowing(one).applied(posterior, T_NS)
    assert later.mean[1] == pytest.approx(49.0 - 0.5 * 0.25 / (0.25 + 0.02))
    unlearned = knowing(observed(posterior, 300.0)).applied(posterior, T_NS)
    assert unlearned.mean[1] == 49.0


def test_the_lateral_place_learns_with_the_payload() -> None:
    """What moves both errs in both."""
    three = Posterior(
        np.array([330.0, 50.0, 0.03]), np.diag([25.0, 0.04, 1e-6]), {Source.CALIBRATION: np.array([[40.0, 0.0, 0.01]])}
    )
    later = knowing(observed(weighed(330.0, CALIBRATION=40.0), 300.0)).applied(three, T_NS)
    assert later.mean[2] == pytest.approx(0.03 - 0.01 * 40.0 * 30.0 / (40.0**2 + 34.0))


def test_causes_that_no_known_weight_had_stay_as_they_are() -> None:
    known = knowing(observed(weighed(330.0, CALIBRATION=40.0), 300.0))
    columns = np.array([[20.0, 0.0], [7.0, 0.1]])
    more = Posterior(
        np.array([150.0, 50.0]), np.diag([25.0, 0.04]), {Source.CALIBRATION: columns, Source.GOODS: columns}
    )
    later = known.applied(more, T_NS)
    assert later.sources[Source.CALIBRATION][1].tolist() == [7.0, 0.1]
    assert later.sources[Source.GOODS].tolist() == columns.tolist()


def test_each_source_keeps_its_name() -> None:
    """A ticket that could not tell two causes apart narrows both, and leaves each its own part of the error."""
    known = knowing(observed(weighed(330.0, CALIBRATION=40.0, SENSOR=40.0), 300.0))
    alone = Posterior(np.array([150.0, 50.0]), np.diag([25.0, 0.04]), {Source.SENSOR: np.array([[20.0, 0.0]])})
    later = known.applied(alone, T_NS)
    assert later.share_of(Source.SENSOR)[0] > later.share_of(Source.CALIBRATION)[0]
    assert later.covariance[0, 0] - 25.0 == pytest.approx(20.0**2 * (1.0 - 40.0**2 / (2.0 * 40.0**2 + 34.0)))


def test_of_another_calibration_or_estimator_it_knows_nothing() -> None:
    one = observed(weighed(330.0, CALIBRATION=40.0), 300.0)
    known = knowing(one)
    assert known.is_for(ID, BY)
    assert not known.is_for("sha256:cd", BY)
    assert not known.is_for(ID, "ratio_index")
    other = Observation("b", T_NS, "sha256:cd", BY, one.posterior, one.truth, one.truth_covariance)
    with pytest.raises(ValueError, match="several calibrations"):
        Knowledge.of([one, other])


@pytest.mark.parametrize(("off_kg", "is_contradicted"), [(0.0, False), (2.9, False), (3.1, True), (-3.1, True)])
def test_a_weight_far_from_its_estimate_is_contradicted(off_kg: float, is_contradicted: bool) -> None:
    std_kg = np.sqrt(5.0**2 + 12.0**2 + 3.0**2)
    one = observed(weighed(300.0 + off_kg * std_kg, CALIBRATION=12.0), 300.0)
    assert one.distance == pytest.approx(abs(off_kg))
    assert one.is_contradicted is is_contradicted is (abs(off_kg) > CONTRADICTED)


def test_known_weights_make_later_estimates_as_sure_as_they_say() -> None:
    """Many vehicles, each with its own z, one ticket each: errors of another load scatter as stated."""
    rng = np.random.default_rng(6)
    z2 = []
    for _ in range(3000):
        z = rng.standard_normal(2)
        ticket, later = (
            weighed(
                kg + kg / 10.0 * z[0] + 15.0 * z[1] + 5.0 * rng.standard_normal(), CALIBRATION=kg / 10.0, SENSOR=15.0
            )
            for kg in (300.0, 150.0)
        )
        known = knowing(observed(ticket, 300.0 + 3.0 * rng.standard_normal()))
        shown = known.applied(later, T_NS)
        z2.append((shown.mean[0] - 150.0) ** 2 / shown.covariance[0, 0])
    assert np.mean(z2) == pytest.approx(1.0, abs=0.1)
