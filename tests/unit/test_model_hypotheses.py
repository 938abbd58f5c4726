"""What is more than one Gaussian: loads on soft mounts, loads that are spread out, worn dampers, peaks that compete."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtr
from support.taught_van import ROLL, VAN, car, drive_of, estimated, lost, spectra_of, taught

from gateway.core.cargo import known_shape, shape_hypotheses
from gateway.estimates.batch_estimate import Estimate, Quantity
from gateway.estimates.posterior import NORMAL_TAILS
from gateway.model import answer, fit, mixture
from gateway.model.answer import posterior_of
from gateway.model.hypotheses import Hypothesis, hypotheses_of
from gateway.model.mixture import BatchLikelihood, Mixture, Peak, mixture_of
from gateway.model.sensors import GAIN_STD
from gateway.model.table import INDEX, N
from gateway.model.vehicle_model import VehicleModel
from gateway.model.whittle import Whittle
from gateway.records import F64, Batch

FIRM_HZ = 28.0


def holds(quantity: Quantity, truth: float) -> bool:
    return quantity.interval95[0] <= truth <= quantity.interval95[1]


def told(load: tuple[float, float], seed: int, *, with_roll: bool = True, **changed: float) -> Estimate:
    theta = car(with_roll=with_roll, **changed)
    return estimated(drive_of(load, seed, with_roll=with_roll, theta=theta), taught(with_roll=with_roll))


def found(load: tuple[float, float], seed: int, theta: F64, model: VehicleModel) -> Mixture:
    spectra = spectra_of(drive_of(load, seed, with_roll=True, theta=theta), model)
    return mixture_of(spectra, model, known_shape(*model.known_shape))


@ROLL
@pytest.mark.parametrize("load", [(250.0, 54.0), (400.0, 44.0)], ids=str)
@pytest.mark.parametrize("damping", [0.06, 0.1, 0.3])
def test_a_load_that_rings_at_9_hz_is_weighed(load: tuple[float, float], damping: float, with_roll: bool) -> None:
    """With damping other than any known load had, too."""
    one = told(load, 41, with_roll=with_roll, payload_mode_hz=9.0, payload_damping_ratio=damping)
    assert one.counted, one.rejected
    assert holds(one.payload, load[0])
    assert holds(one.front_share, load[1])
    assert one.diagnostics["payload_mode_hz"] == pytest.approx(9.0, rel=0.15)


@ROLL
@pytest.mark.parametrize("load", [(250.0, 55.0), (400.0, 44.0)], ids=str)
@pytest.mark.parametrize("mode_hz", [13.0, 17.0])
def test_a_payload_on_pallets_is_weighed_and_its_mode_found(
    load: tuple[float, float], mode_hz: float, with_roll: bool
) -> None:
    """The known loads rang at 28 Hz; at 8 Hz one that rings at 13 Hz weighs half as much again."""
    one = told(load, 31, with_roll=with_roll, payload_mode_hz=mode_hz)
    assert holds(one.payload, load[0])
    assert holds(one.front_share, load[1])
    assert one.payload.number == pytest.approx(load[0], abs=40.0)
    assert one.diagnostics["payload_mode_hz"] == pytest.approx(mode_hz, rel=0.2)


@ROLL
@pytest.mark.parametrize("load", [(0.0, 52.0), (60.0, 51.0), (250.0, 54.0), (400.0, 44.0)], ids=str)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_firm_load_is_not_taken_for_soft(load: tuple[float, float], seed: int, with_roll: bool) -> None:
    one = told(load, seed, with_roll=with_roll)
    assert holds(one.payload, load[0])
    assert one.diagnostics["payload_mode_hz"] > 0.6 * FIRM_HZ


@ROLL
@pytest.mark.parametrize("firmer", [0.96, 1.04])
def test_tyres_of_another_day_stay_within_the_interval(firmer: float, with_roll: bool) -> None:
    one = told((200.0, 50.0), 3, with_roll=with_roll, tyre_rear_npm=firmer * 3.8e5)
    assert one.counted, one.rejected
    assert holds(one.payload, 200.0)
    assert holds(one.front_share, 50.0)


def with_dampers(front: float, rear: float, seed: int, *, with_roll: bool) -> Estimate:
    changed = {"damper_front_nspm": front * 3.9e3, "damper_rear_nspm": rear * 4.1e3}
    return told((250.0, 52.0), seed, with_roll=with_roll, **changed)


@pytest.mark.parametrize(
    ("front", "rear", "seed", "with_roll"),
    [
        (0.65, 0.65, 43, False),
        (0.65, 0.65, 43, True),
        (1.0, 0.65, 43, False),
        (1.0, 0.65, 43, True),
        (1.0, 0.65, 44, True),
        (1.0, 1.74, 43, False),
        (1.0, 1.74, 43, True),
    ],
)
def test_dampers_that_have_worn_or_were_replaced_do_not_spoil_the_weight(
    front: float, rear: float, seed: int, with_roll: bool
) -> None:
    one = with_dampers(front, rear, seed, with_roll=with_roll)
    assert one.counted, one.rejected
    assert holds(one.payload, 250.0)
    assert holds(one.front_share, 52.0)


BOTH = lost("found as 0.82 to 0.85: other parameters take a part of what both axles have in common")


@pytest.mark.parametrize(
    ("front", "rear", "with_roll"),
    [
        pytest.param(0.65, 0.65, False, marks=BOTH),
        pytest.param(0.65, 0.65, True, marks=BOTH),
        (1.0, 0.65, False),
        (1.0, 0.65, True),
        (1.0, 1.74, False),
        (1.0, 1.74, True),
    ],
)
def test_it_is_found_how_far_dampers_have_worn(front: float, rear: float, with_roll: bool) -> None:
    found = with_dampers(front, rear, 43, with_roll=with_roll).diagnostics
    assert found["damper_front_ratio"] == pytest.approx(front, rel=0.1)
    assert found["damper_rear_ratio"] == pytest.approx(rear, rel=0.1)


@pytest.mark.parametrize("rate", [0.7, 1.4])
def test_springs_that_are_not_the_vehicle_s_are_refused_or_within_the_interval(rate: float) -> None:
    """No day explains them."""
    changed = {"spring_front_npm": rate * 62e3, "spring_rear_npm": rate * 70e3}
    one = told((200.0, 50.0), 67, **changed)
    assert not one.counted or holds(one.payload, 200.0)


def shapes_of(model: VehicleModel, batch: Batch) -> Mixture:
    return mixture_of(spectra_of(batch, model), model, shape_hypotheses(VAN, *model.known_shape))


@ROLL
@pytest.mark.parametrize("gyration_m2", [0.1, 1.0])
def test_a_load_of_unstated_shape_is_held(gyration_m2: float, with_roll: bool) -> None:
    model = taught(with_roll=with_roll)
    theta = car(with_roll=with_roll, payload_gyration_m2=gyration_m2)
    mixture = shapes_of(model, drive_of((350.0, 47.0), 51, with_roll=with_roll, theta=theta))
    told = posterior_of(mixture, model, 1.0, GAIN_STD)
    assert holds(told.quantity(0), 350.0)
    assert holds(told.quantity(1), 47.0)


def peak(payload_kg: float, front_share: float, log_evidence: float, hypothesis: Hypothesis | None = None) -> Peak:
    (known,) = hypotheses_of(taught(), known_shape(*taught().known_shape), (0.0, GAIN_STD), with_roll=False)
    hypothesis = hypothesis or known
    covariance = 0.5 * np.diag(np.r_[np.diag(hypothesis.covariance), 2.0 * 10.0**2, 2.0 * 0.001**2])
    return Peak(hypothesis, np.r_[hypothesis.mean, payload_kg, front_share], covariance, log_evidence, True)


def test_peaks_of_one_hypothesis_that_coincide_are_one() -> None:
    best = peak(200.0, 0.5, -10.0)
    (only,) = mixture._distinct([peak(201.0, 0.5, -10.5), best])
    assert only is best


def test_a_peak_far_below_the_best_is_none() -> None:
    assert len(mixture._distinct([peak(200.0, 0.5, -10.0), peak(400.0, 0.5, -100.0)])) == 1
    assert len(mixture._distinct([peak(200.0, 0.5, -10.0), peak(400.0, 0.5, -12.0)])) == 2


@pytest.mark.parametrize("is_soft", [True, False], ids=["on a soft mount", "on a firm mount"])
def test_every_load_is_tried_where_the_peaks_found_need_an_unlikely_vehicle(
    is_soft: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both searches once ended at such peaks. A load of 628 kg was weighed to 114 kg, for no heavy load was tried, and
    one of 557 kg to -56 kg, for heavy loads were tried on a soft mount alone.
    """
    model = taught()
    (known,) = hypotheses_of(model, known_shape(*model.known_shape), (0.0, GAIN_STD), with_roll=False)
    spectra = spectra_of(drive_of((0.0, 50.0), 3, with_roll=False), model)
    own = mixture.BatchLikelihood(Whittle(spectra, model.ground), np.empty(0), 0.0, 1e4)
    heaviest_kg = max(payload_kg for payload_kg, _ in mixture.starting_loads(model))
    unlikely = np.zeros(N + 2)
    unlikely[INDEX["pitch_inertia_kgm2"]] = 1.0

    def climbed(own: object, hypothesis: Hypothesis, start: F64, *others: object) -> Peak:
        if start[N] == heaviest_kg and hypothesis.is_soft is is_soft:
            return peak(heaviest_kg, 0.5, -10.0, hypothesis)
        light = peak(float(start[N]), 0.5, -20.0, hypothesis)
        return replace(light, x=light.x + unlikely)

    monkeypatch.setattr(mixture, "climb", climbed)
    found = mixture._coarse(own, known, model)
    assert found[0].load.payload_kg == heaviest_kg
    assert found[0].tension < mixture.DOUBTFUL < found[1].tension


@given(st.lists(st.floats(0.0, 50.0), min_size=2, max_size=5))
def test_a_peak_with_less_evidence_weighs_less_but_never_vanishes(excess: list[float]) -> None:
    """By a power of its excess, for the model may err, and not exponentially."""
    rising = np.sort(excess)
    against = mixture._against(rising)
    assert np.all(np.diff(against) >= 0.0)
    assert mixture._against(np.zeros(1))[0] == 0.0
    assert np.all(against <= rising * (mixture.EVIDENCE_DOF + 1.0) / mixture.EVIDENCE_DOF + 1e-12 + 5.0 * rising)
    assert mixture._against(np.array([50.0]))[0] < 15.0


def two(apart_kg: float, weights: tuple[float, float], share_apart: float = 0.0) -> Mixture:
    """The mixture of a real batch, with a rival put beside its best peak."""
    model = taught()
    alone = mixture_of(spectra_of(drive_of((200.0, 50.0), 3), model), model, known_shape(*model.known_shape))
    best = alone.best
    there = best.x.copy()
    there[N:] += apart_kg, share_apart
    return replace(alone, peaks=(best, replace(best, x=there)), weights=np.array(weights))


def test_a_rival_widens_the_answer_by_its_distance_and_weight() -> None:
    model = taught()
    alone, beside = (
        posterior_of(one, model, 1.0, GAIN_STD) for one in (two(0.0, (1.0, 0.0)), two(100.0, (0.7, 0.3), -0.02))
    )
    between = 0.7 * 0.3 * 100.0**2 * model.spread[0] ** 2
    assert beside.std(0) ** 2 - alone.std(0) ** 2 == pytest.approx(between, rel=1e-3)
    assert beside.std(1) > alone.std(1)
    assert alone.mean[0] <= beside.mean[0] < alone.mean[0] + 100.0
    assert alone.tails == NORMAL_TAILS


def test_an_interval_reaches_as_far_as_the_posterior_does() -> None:
    """The ends of a batch's interval, by a search at every payload in place of one step at two."""
    model = taught()
    alone = two(0.0, (1.0, 0.0))
    own = BatchLikelihood(alone.whittle, alone.point.theta[N:], alone.point.cg_left_m, np.inf)
    best, prior = alone.best, alone.best.hypothesis.prior
    std_kg = float(best.covariance[N, N]) ** 0.5
    top = own.cost(np.empty(0), best.x) + prior.cost(best.x)
    for lean, sign in zip(answer._leans_of(alone), (-1.0, 1.0), strict=True):
        at_kg = best.x[N] + sign * answer.LEAN_AT * std_kg
        held = fit.Gaussian(prior.mean.copy(), prior.precision.copy())
        held.mean[N], held.precision[N, N] = at_kg, 1e6 / std_kg**2
        found = fit.climb(own, held, best.x + sign * answer.LEAN_AT * best.covariance[:, N] / std_kg, 1e-3).own[0]
        drop = own.cost(np.empty(0), found) + prior.cost(found) - top
        expected = np.clip(answer.LEAN_AT / (2.0 * drop) ** 0.5, 1.0, answer.MOST_LEAN)
        assert lean == pytest.approx(expected, abs=0.03)
    assert posterior_of(alone, model, 1.0, GAIN_STD).leans == answer._leans_of(alone)


@given(
    middles=st.lists(st.floats(-100.0, 100.0), min_size=1, max_size=4),
    std=st.floats(0.5, 50.0),
    seed=st.integers(0, 1000),
)
def test_quantiles_of_a_mixture_are_where_its_distribution_has_them(
    middles: list[float], std: float, seed: int
) -> None:
    weights = np.random.default_rng(seed).uniform(0.1, 1.0, len(middles))
    weights /= weights.sum()
    at = np.array(answer._quantiles(np.array(middles), weights, std))
    cumulated = weights @ ndtr((at - np.array(middles)[:, None]) / std)
    np.testing.assert_allclose(cumulated, [0.025, 0.5, 0.975], atol=3e-3)
