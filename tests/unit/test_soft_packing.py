"""A load that rings on something soft, a firm one that must not be taken for it, peaks that compete, a soft mass."""

from dataclasses import replace

import numpy as np
import pytest
from support.half_car_road import CAR, batch_over_road, calibrated_on_known_loads, weighed

from gateway.core.cross_spectrum import located
from gateway.core.cross_spectrum.calibration import CrossSpectrumCalibration
from gateway.core.cross_spectrum.drift import DRIFTING, drift_precision
from gateway.core.cross_spectrum.likelihood import EVIDENCE_WEIGHT
from gateway.core.cross_spectrum.model.motion import Frame, Motion, Numbers
from gateway.core.cross_spectrum.packing import DECISIVE, SOFT_COST, Packing, packings
from gateway.core.cross_spectrum.search import Found
from gateway.core.cross_spectrum.soft_mass import DAMPING_RATIO, RESONANCES_HZ, SoftMass, mounted
from gateway.estimate import Estimate, Quantity
from gateway.posterior import Source

FIRM_HZ = CAR.payload_mode_hz


@pytest.fixture(scope="module")
def calibration() -> CrossSpectrumCalibration:
    """Of loads that stood firmly."""
    return calibrated_on_known_loads()


def of_model(found: Estimate) -> float:
    """Standard deviation of the payload by the model's own error."""
    return float(np.linalg.norm(found.posterior.sources[Source.MODEL][:, 0]))


def holds(quantity: Quantity, truth: float) -> bool:
    return quantity.interval95[0] <= truth <= quantity.interval95[1]


def ringing(
    calibration: CrossSpectrumCalibration, load: tuple[float, float], mode_hz: float, damping: float, seed: int
) -> Estimate:
    soft = replace(CAR, payload_mode_hz=mode_hz, payload_damping_ratio=damping)
    return weighed(batch_over_road(*load, seed=seed, car=soft), calibration)


@pytest.mark.parametrize("load", [(250.0, 54.0), (400.0, 44.0)], ids=str)
@pytest.mark.parametrize("damping", [0.06, 0.1, 0.3])
def test_a_load_that_rings_at_9_hz_is_weighed(
    calibration: CrossSpectrumCalibration, load: tuple[float, float], damping: float
) -> None:
    """With damping other than any calibration saw, too."""
    found = ringing(calibration, load, 9.0, damping, seed=41)
    assert found.counted, found.rejected
    assert holds(found.payload, load[0])
    assert holds(found.front_share, load[1])
    assert found.diagnostics["payload_mode_hz"] == pytest.approx(9.0, rel=0.1)


@pytest.mark.parametrize(("front", "rear"), [(0.65, 0.65), (1.0, 0.65)])
def test_dampers_that_have_worn_are_found_and_do_not_spoil_the_weight(
    calibration: CrossSpectrumCalibration, front: float, rear: float
) -> None:
    load = (250.0, 52.0)
    worn = replace(
        CAR,
        front=replace(CAR.front, damper_nspm=front * CAR.front.damper_nspm),
        rear=replace(CAR.rear, damper_nspm=rear * CAR.rear.damper_nspm),
    )
    found = weighed(batch_over_road(*load, seed=43, car=worn), calibration)
    assert found.counted, found.rejected
    assert holds(found.payload, load[0])
    assert holds(found.front_share, load[1])
    assert found.diagnostics["damper_front_freed_ratio"] == pytest.approx(front, rel=0.1)
    assert found.diagnostics["damper_rear_freed_ratio"] == pytest.approx(rear, rel=0.1)
    healthy = weighed(batch_over_road(*load, seed=43), calibration)
    assert of_model(found) > 3.0 * of_model(healthy)  # the rest of the vehicle is no longer as calibrated either


def test_healthy_dampers_are_not_sought_as_worn_ones(calibration: CrossSpectrumCalibration) -> None:
    told = weighed(batch_over_road(250.0, 52.0, seed=43), calibration).diagnostics
    for axle in ("front", "rear"):
        assert told[f"damper_{axle}_freed_ratio"] == told[f"damper_{axle}_ratio"] == pytest.approx(1.0, abs=0.05)


def test_it_would_not_be_if_loads_were_only_thought_to_stand_firmly(
    calibration: CrossSpectrumCalibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nowhere near as well: further off, and a few times as uncertain."""
    load = (400.0, 44.0)
    rightly = ringing(calibration, load, 9.0, 0.1, seed=41)
    monkeypatch.setattr(located, "packings", lambda parameters, precision: packings(parameters, precision)[:1] * 2)
    monkeypatch.setattr(located, "LEAST_STRAIN", np.inf)  # worn dampers explain some of it too
    found = ringing(calibration, load, 9.0, 0.1, seed=41)
    assert not found.counted or found.payload.std > 3.0 * rightly.payload.std


@pytest.mark.parametrize("load", [(0.0, 52.0), (60.0, 51.0), (250.0, 54.0), (400.0, 44.0)], ids=str)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_firm_load_is_not_taken_for_soft(
    calibration: CrossSpectrumCalibration, load: tuple[float, float], seed: int
) -> None:
    found = weighed(batch_over_road(*load, seed=seed), calibration)
    assert holds(found.payload, load[0])
    assert found.diagnostics["payload_mode_hz"] > 0.6 * FIRM_HZ


def test_a_real_cars_rattle_is_no_soft_load() -> None:
    """What a soft packing gains must be far beyond what seats and people gain (51), and a prior cost beside it."""
    firm, soft = packings(np.zeros(100), drift_precision())
    assert firm.decisive == firm.cost == 0.0
    assert soft.decisive == DECISIVE > 51.0
    assert soft.cost == SOFT_COST > 0.0


def peak(payload_kg: float, front_share: float, cost: float, packing: Packing) -> located._Peak:
    x = np.r_[packing.drifting, payload_kg, front_share]
    return located._Peak(Found(x, cost, np.eye(len(x)), is_converged=True, near=x), packing)


FIRM, SOFT = packings(np.zeros(100), drift_precision())


def test_a_peak_alone_adds_nothing() -> None:
    best = peak(200.0, 0.5, 10.0, FIRM)
    np.testing.assert_array_equal(located._rivalry(best.found, [best]), np.zeros((2, 2)))


@pytest.mark.parametrize("behind", [0.0, 3.0, 20.0, 200.0])
def test_a_second_peak_widens_by_how_probable_it_is(behind: float) -> None:
    """The variance about the best of two points, the odds between them e^-(weight times cost)."""
    best, rival = peak(200.0, 0.5, 10.0, FIRM), peak(260.0, 0.47, 10.0 + behind, FIRM)
    odds = np.exp(-EVIDENCE_WEIGHT * behind)
    away = np.array([60.0, -0.03])
    expected = odds / (1.0 + odds) * np.outer(away, away)
    np.testing.assert_allclose(located._rivalry(best.found, [best, rival]), expected, rtol=1e-12)


def test_a_soft_rival_counts_for_less() -> None:
    best = peak(200.0, 0.5, 10.0, FIRM)
    firm, soft = (located._rivalry(best.found, [best, peak(260.0, 0.47, 10.0, one)]) for one in (FIRM, SOFT))
    odds = np.exp(-EVIDENCE_WEIGHT * SOFT_COST)
    assert soft[0, 0] == pytest.approx(firm[0, 0] * 2.0 * odds / (1.0 + odds))


@pytest.mark.parametrize(("behind", "is_told"), [(0.0, True), (100.0, False)])
def test_an_answer_of_two_peaks_is_wider(
    calibration: CrossSpectrumCalibration, monkeypatch: pytest.MonkeyPatch, behind: float, is_told: bool
) -> None:
    """A peak put beside the found one, 25 kg away: as good, or far behind."""
    batch = batch_over_road(200.0, 50.0, seed=3)
    alone = weighed(batch, calibration)
    rivalry = located._rivalry

    def beside(found: Found, peaks: list[located._Peak]) -> object:
        rival = found.x.copy()
        rival[-2:] += 25.0, -0.004
        return rivalry(found, [*peaks, peak_of(rival, found.cost + behind)])

    def peak_of(x: np.ndarray, cost: float) -> located._Peak:
        return located._Peak(
            Found(x, cost, np.eye(len(x)), is_converged=True, near=x), Packing(x[: len(DRIFTING)], drift_precision())
        )

    monkeypatch.setattr(located, "_rivalry", beside)
    found = weighed(batch, calibration)
    assert found.payload.number == alone.payload.number
    if is_told:
        assert found.payload.std**2 > alone.payload.std**2 + 200.0  # of 312 kg2, by half of what both peaks weigh
        assert holds(found.payload, alone.payload.number + 15.0)
    else:
        assert found.payload.std == pytest.approx(alone.payload.std, rel=1e-3)


FREQ_HZ = np.linspace(1.0, 14.0, 40)
WHEELBASE_M = 2.7
BEHIND_M = 3.6
AXLE = (40e3, 3e3, 500e3, 400e3, 80.0)


def van(*carried_kg: float, mode_hz: float = 25.0) -> Motion:
    """A van with a load (front-front, rear-rear, front-rear) on a floor of this frequency."""
    numbers = Numbers.of(AXLE, AXLE, (600.0, 640.0, 40.0), carried_kg, (mode_hz, DAMPING_RATIO), (1.6, 0.002))
    return Motion(numbers, Frame(WHEELBASE_M), FREQ_HZ, n_sensors=2)


@pytest.mark.parametrize("which", range(len(RESONANCES_HZ)))
def test_its_slope_is_that_of_a_small_load_that_swings_there(which: int) -> None:
    """A tenth of a gram on a floor of that frequency, at the same place, moves the sensors by that slope."""
    rear = BEHIND_M / WHEELBASE_M
    front = 1.0 - rear
    small_kg = 1e-4
    swinging = van(*(small_kg * np.array([front**2, rear**2, front * rear])), mode_hz=RESONANCES_HZ[which])
    empty = van(0.0, 0.0, 0.0)
    slope = empty.by_suspended_mass(BEHIND_M, mounted(FREQ_HZ).felt)[which]
    moved = (swinging.paths - empty.paths) / small_kg
    assert np.abs(slope - moved).max() < 1e-5 * np.abs(moved).max()


def test_a_mass_that_does_not_swing_is_a_rigid_one() -> None:
    rear = BEHIND_M / WHEELBASE_M
    front = 1.0 - rear
    empty = van(0.0, 0.0, 0.0)
    by_rigid = empty.slopes([10, 11, 12])  # the three masses of the body
    expected = front**2 * by_rigid[0] + rear**2 * by_rigid[1] + front * rear * by_rigid[2]
    assert np.allclose(empty.by_suspended_mass(BEHIND_M, np.ones((1, len(FREQ_HZ))))[0], expected, rtol=1e-9)


@pytest.mark.parametrize(
    ("kg", "score", "is_there"),
    [(31.0, 10.7, True), (5.0, 5.8, False), (12.0, 3.1, False), (-20.0, 8.0, False)],
)
def test_it_is_there_where_chance_does_not_explain_it_and_it_is_heavy_enough(
    kg: float, score: float, is_there: bool
) -> None:
    assert SoftMass(kg, 3.0, score).is_there == is_there
