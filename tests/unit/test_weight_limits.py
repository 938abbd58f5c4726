"""Weights and their limits: standard deviations from slopes, how probable it is that one is over its limit, and how
much more may go in."""

import json
import math
from collections.abc import Callable
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from support.archive import write_manifest
from support.cab import aboard
from support.calibrated import calibration_text
from support.commands import called
from support.configured import service_config
from support.estimates import make_estimate, posterior_of
from support.paper_van import paper_van

from gateway.archive.manifest import load_manifest
from gateway.config import load_settings
from gateway.core.vehicle import cg_left_m, front_share_pct
from gateway.core.weights.limits import Light, Limits, nearness, over_limit_probability, rooms_of
from gateway.core.weights.on_the_road import PayloadPlace, place_of, weighed, weights_of
from gateway.errors import ConfigurationError
from gateway.estimates.as_json import table_row
from gateway.estimates.batch_estimate import PLACES, Z95, Estimate, Quantity, Weight, Weights
from gateway.estimates.posterior import Posterior, Source
from gateway.setup import Setup, setup_of

UNSPRUNG = {"unsprung_front_kg": 80.0, "unsprung_rear_kg": 80.0}


@pytest.mark.parametrize(
    ("kg", "std_kg", "limit_kg", "probability"),
    [
        (2000.0, 12.0, 2000.0, 0.5),
        (2000.0 - 12.0, 12.0, 2000.0, 0.158655),
        (2000.0 - 1.959964 * 12.0, 12.0, 2000.0, 0.025),
        (2000.0 - 3.0 * 12.0, 12.0, 2000.0, 0.001350),
        (2000.1, 0.0, 2000.0, 1.0),
        (2000.0, 0.0, 2000.0, 0.0),
        (1.0, 1.0, None, math.nan),
        (math.nan, 1.0, 2.0, math.nan),
        (1.0, math.nan, 2.0, math.nan),
    ],
)
def test_the_probability_is_the_tables(kg: float, std_kg: float, limit_kg: float | None, probability: float) -> None:
    """Abramowitz and Stegun, table 26.1; without an error it is 0 or 1, and NaN for what is unknown."""
    assert over_limit_probability(kg, std_kg, limit_kg) == pytest.approx(probability, abs=1e-6, nan_ok=True)


def configured(folder: Path, vehicle: str = "") -> Path:
    """springscale.toml beside a calibration that allows 2000 kg, and nothing else."""
    folder.mkdir(exist_ok=True)
    calibration = calibration_text(rear_axle_limit_kg=1100.0, **UNSPRUNG)
    return service_config(folder, calibration, f'[vehicle]\nid = "van-17"\n{vehicle}', estimator="ratio_index")


def loaded(folder: Path, vehicle: str = "") -> Setup:
    return setup_of(load_settings(configured(folder, vehicle)))


def batch(setup: Setup) -> Estimate:
    """500 kg aboard, a little more of all on the rear axle: 1900 kg gross, 940 kg on the rear axle."""
    return weighed(make_estimate(1).answered(posterior_of(500.0, 50.575, 6.0, 0.1)), setup.calibrated.vehicle)


def test_settings_override_the_limits_of_the_calibration(tmp_path: Path) -> None:
    as_calibrated = loaded(tmp_path / "a")
    assert Limits.of(as_calibrated.calibrated.vehicle) == Limits(gross_limit_kg=2000.0, rear_axle_limit_kg=1100.0)
    as_set = loaded(tmp_path / "b", "gross_limit_kg = 1850.0\nfront_wheel_limit_kg = 500.0")
    assert Limits.of(as_set.calibrated.vehicle) == Limits(
        gross_limit_kg=1850.0, rear_axle_limit_kg=1100.0, front_wheel_limit_kg=500.0
    )
    assert as_set.calibrated.id == as_calibrated.calibrated.id


@pytest.mark.parametrize("wrong", ["0", "-3500.0", "3_500_000.0", "nan", "inf", '"heavy"'])
def test_a_limit_that_no_vehicle_has_is_named(wrong: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"springscale.toml: vehicle\.rear_axle_limit_kg"):
        loaded(tmp_path, f"rear_axle_limit_kg = {wrong}")


def test_the_table_shows_limits_and_exceeded_ones(tmp_path: Path) -> None:
    row = table_row(batch(loaded(tmp_path, "gross_limit_kg = 1850.0\nfront_axle_limit_kg = 900.0")))
    assert [row[f"{place}_limit_kg"] for place in ("gross", "front_axle", "rear_axle")] == [1850.0, 900.0, 1100.0]
    assert row["rear_left_limit_kg"] is None
    assert row["over_limit"] == "gross front_axle"


def test_check_config_prints_the_limits_in_force(tmp_path: Path) -> None:
    path = configured(tmp_path, "gross_limit_kg = 1850.0")
    said = called("check-config", path, "--json")
    assert json.loads(said.output)["limits"] == {"gross_limit_kg": 1850.0, "rear_axle_limit_kg": 1100.0}
    words = called("check-config", path).output
    assert "It may weigh: gross_limit_kg 1850 kg, rear_axle_limit_kg 1100 kg." in words


def test_check_config_reports_missing_limits(tmp_path: Path) -> None:
    path = configured(tmp_path)
    (tmp_path / "vehicle.json").write_text(calibration_text(gross_limit_kg=None))
    assert "No limit is known" in called("check-config", path).output


def test_an_archive_is_judged_by_its_manifests_limits(tmp_path: Path) -> None:
    """The top's for every vehicle, an entry's for this one."""
    path = write_manifest(
        tmp_path, "van-1", 'id = "van-2"\nrear_axle_limit_kg = 900.0', more="gross_limit_kg = 1850.0\n"
    )
    one, other = load_manifest(str(path)).assignments
    assert one.setup.limits == Limits(gross_limit_kg=1850.0)
    assert other.setup.limits == Limits(gross_limit_kg=1850.0, rear_axle_limit_kg=900.0)
    assert other.setup.calibrated.vehicle.rear_axle_limit_kg == 900.0


WITHIN = st.floats(0.0, 1.0)


@given(WITHIN, st.floats(0.0, 450.0), st.floats(44.0, 54.0))
def test_the_tightest_room_fits_anywhere_between_the_axles(
    front_part: float, payload_kg: float, front_share_pct: float
) -> None:
    before = aboard(payload_kg, front_share_pct)
    more_kg = rooms_of(before)[0].left.number
    if more_kg <= 0.0:
        return
    front_kg = front_share_pct / 100.0 * (1240.0 + payload_kg) + front_part * more_kg
    after = aboard(payload_kg + more_kg, 100.0 * front_kg / (1240.0 + payload_kg + more_kg))
    assert all(weight.kg <= weight.limit_kg + 1e-6 for _, weight in after.items() if weight.limit_kg is not None)
    tightest = {room.place: room.left.number for room in rooms_of(after)}
    assert min(tightest.values()) >= -1e-6


def test_without_limit_or_weight_the_room_is_unknown() -> None:
    assert rooms_of(Weights()) == ()
    assert rooms_of(Weights(gross=Weight(1700.0, 6.0, None, None))) == ()
    assert rooms_of(Weights(gross=Weight(limit_kg=2000.0))) == ()
    assert nearness(Weights()).light is Light.UNKNOWN
    assert nearness(Weights()).places() == ()


def test_how_sure_it_is_unknown_still_leaves_room() -> None:
    [room] = rooms_of(Weights(gross=Weight(1700.0, math.nan, 2000.0, None)))
    assert room.surely_kg == 300.0


@pytest.mark.parametrize(
    ("kg", "light"),
    [(1900.0, Light.GO), (1980.3, Light.GO), (1980.5, Light.NEAR), (1999.9, Light.NEAR), (2000.1, Light.OVER)],
)
def test_the_light_turns_where_the_limit_enters_the_interval_and_at_the_limit(kg: float, light: Light) -> None:
    """10 kg of standard deviation: the upper end of the interval is 19.6 kg above."""
    found = nearness(Weights(gross=Weight(kg, 10.0, 2000.0, None), rear_axle=Weight(500.0, 5.0, 1000.0, None)))
    assert found.light is light
    assert found.places() == (() if light is Light.GO else ("gross",))


OTHER_VAN = paper_van(
    empty_front_share_pct=57.0,
    empty_front_share_std_pct=0.0,
    track_width_m=1.5,
    empty_cg_left_m=0.06,
    unsprung_front_kg=90.0,
    unsprung_rear_kg=110.0,
)
STDS = np.array([9.0, 0.4, 0.006, 0.05])
CORRELATIONS = {(0, 1): -0.5, (0, 2): 0.3, (1, 2): -0.4}


@dataclass(frozen=True)
class State:
    """A point with 400 kg aboard, 0.25 m right of the centre line."""

    payload_kg: float = 400.0
    share_pct: float = front_share_pct(OTHER_VAN, 400.0, 1.9)
    cg_left_m: float = cg_left_m(OTHER_VAN, 400.0, -0.25)
    roll_share: float = 0.62


def posterior(state: State) -> Posterior:
    """Half of the covariance is own, half from sources; the empty share has an error too, which leaves the place
    alone."""
    correlations = np.eye(3)
    for (one, other), shared in CORRELATIONS.items():
        correlations[one, other] = correlations[other, one] = shared
    covariance = correlations * np.outer(STDS[:3], STDS[:3])
    columns = np.sqrt(0.5) * np.linalg.cholesky(covariance).T
    sources = {Source.CALIBRATION: columns[:2], Source.LOAD_LENGTH: columns[2:]}
    return Posterior(np.array([state.payload_kg, state.share_pct, state.cg_left_m]), 0.5 * covariance, sources)


def weights(state: State) -> Weights:
    return weights_of(OTHER_VAN, posterior(state), Quantity(state.roll_share, STDS[3]))


def place(state: State) -> PayloadPlace:
    found = place_of(OTHER_VAN, posterior(state).with_source(Source.EMPTY_SHARE, np.array([[0.0, 0.8, 0.0]])))
    assert found is not None
    return found


def errors(of: Callable[[State], tuple[float, ...]]) -> NDArray[np.float64]:
    """Covariance of what ``of`` tells, by central differences."""
    slopes, names = [], list(State.__dataclass_fields__)
    for name, std in zip(names, STDS, strict=True):
        step = 1e-4 * std
        up, down = (replace(State(), **{name: getattr(State(), name) + way * step}) for way in (1.0, -1.0))
        slopes.append((np.array(of(up)) - np.array(of(down))) / (2.0 * step))
    correlations = np.eye(4)
    for (one, other), shared in CORRELATIONS.items():
        correlations[one, other] = correlations[other, one] = shared
    return np.array(slopes).T @ (correlations * np.outer(STDS, STDS)) @ np.array(slopes)


@pytest.mark.parametrize("name", PLACES)
def test_errors_of_weights_propagate(name: str) -> None:
    [[variance]] = errors(lambda state: (getattr(weights(state), name).kg,))
    found, std_kg = getattr(weights(State()), name), math.sqrt(variance)
    assert found.std_kg == pytest.approx(std_kg, rel=1e-6)
    assert found.interval95_kg == pytest.approx((found.kg - Z95 * std_kg, found.kg + Z95 * std_kg), rel=1e-6)


def test_errors_of_the_place_propagate() -> None:
    covariance = errors(lambda state: astuple(place(state))[:3:2])
    found = place(State())
    assert (found.std_m, found.left_std_m) == pytest.approx(tuple(np.sqrt(np.diag(covariance))), rel=1e-6)
    assert found.correlation * found.std_m * found.left_std_m == pytest.approx(covariance[0, 1], rel=1e-6)
