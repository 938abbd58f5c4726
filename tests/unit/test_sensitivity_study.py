"""Constants set for a while and put back, which change of load two batches show, and the page made of it."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from support.half_car_road import VAN, batch_over_road

from benchmarks.accuracy import __main__ as command
from benchmarks.accuracy import drives
from benchmarks.accuracy.drives import Scope
from benchmarks.accuracy.sensitivity import study
from benchmarks.accuracy.sensitivity.changes import pairs_of
from benchmarks.accuracy.sensitivity.constants import CONSTANTS, USED_IN, Acts, Constant, scaled
from benchmarks.accuracy.study import Study
from gateway.calibration.half_car.fit import calibrate_cross_spectrum
from gateway.calibration.judgement.evaluation import Judged
from gateway.calibration.known_run import KnownRun
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.change import Rules
from gateway.core.vehicle import Vehicle
from gateway.estimate import Estimate
from gateway.posterior import Posterior, Source
from gateway.records import Why
from gateway.sim.sensors import REFERENCE


@pytest.mark.parametrize("constant", CONSTANTS, ids=[one.name for one in CONSTANTS])
def test_a_constant_is_other_for_a_while_wherever_it_is_used(constant: Constant) -> None:
    rooms = [module for name, module in sys.modules.items() if name.startswith(USED_IN)]
    users = [room for room in rooms if vars(room).get(constant.name) is constant.current]

    def everywhere() -> list[float]:
        return [np.sum(np.abs(vars(room)[constant.name])) for room in users]

    before = everywhere()
    assert sys.modules[constant.module] in users
    with scaled(constant, 2.0):
        assert everywhere() == [pytest.approx(2.0 * one) for one in before]
        assert type(constant.current) is type(getattr(sys.modules[constant.module], constant.name))
    assert everywhere() == before


def test_a_constant_is_put_back_after_a_fault() -> None:
    with pytest.raises(RuntimeError), scaled(CONSTANTS[0], 0.5):
        raise RuntimeError
    assert CONSTANTS[0].current == 0.2


RULES = Rules(range_kg=1000.0, mass_kg=1500.0)


def judged(payload_kg: float, found_kg: float, own_kg: float, t: int = 0) -> Judged:
    posterior = Posterior(
        np.array([found_kg, 50.0]), np.diag([own_kg**2, 0.25]), {Source.CALIBRATION: np.array([[16.0, 0.3]])}
    )
    return Judged(1, "run", payload_kg, 50.0, Estimate(t, t + 1, "cross_spectrum").answered(posterior))


def test_the_smallest_change_is_that_at_which_the_detector_changes_its_mind() -> None:
    (first,) = pairs_of([[judged(0.0, 0.0, 12.0), judged(0.0, 0.0, 12.0, t=5)]], RULES)
    assert 3.0 < first.smallest_kg / np.hypot(12.0, 12.0) < 6.0
    for change_kg, is_noticed in ((0.99 * first.smallest_kg, False), (1.01 * first.smallest_kg, True)):
        (pair,) = pairs_of([[judged(0.0, 0.0, 12.0), judged(change_kg, change_kg, 12.0, t=5)]], RULES)
        assert pair.smallest_kg == pytest.approx(first.smallest_kg, rel=1e-3)
        assert pair.is_noticed is is_noticed


def test_what_batches_share_hides_no_smaller_change() -> None:
    noisy, sure = (
        pairs_of([[judged(0.0, 0.0, own_kg), judged(0.0, 0.0, own_kg, t=5)]], RULES)[0] for own_kg in (12.0, 3.0)
    )
    assert sure.smallest_kg < 0.35 * noisy.smallest_kg


def test_pairs_are_within_drives_and_from_one_drive_to_the_next() -> None:
    refused = replace(judged(9.0, 9.0, 9.0), estimate=judged(9.0, 9.0, 9.0).estimate.refused(Why.MODEL_MISFIT))
    drives = [[judged(0.0, 1.0, 12.0), refused, judged(0.0, 2.0, 12.0)], [refused], [judged(300.0, 290.0, 12.0)]]
    assert [(pair.change_kg, pair.is_noticed) for pair in pairs_of(drives, RULES)] == [(0.0, False), (300.0, True)]
    moved = replace(judged(200.0, 200.0, 12.0, t=5), front_share_pct=47.0)
    (pair,) = pairs_of([[judged(200.0, 200.0, 12.0), moved]], RULES)
    assert (pair.change_kg, pair.change_pct, pair.is_one_load) == (0.0, -3.0, False)


def test_every_setting_is_weighed_or_inspected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With stand-ins for driving and fitting; then told and written."""
    loads = ((0.0, 52.0), (270.0, 55.5), (270.0, 47.0), (420.0, 41.5))
    runs = [
        KnownRun(i, str(i), *load, (batch_over_road(*load, seed=i, duration_s=100.0),)) for i, load in enumerate(loads)
    ]
    calibration = calibrate_cross_spectrum(runs, VAN)
    calibrated = CalibratedVehicle("x", VAN, (0.0, 420.0), (41.5, 55.5), cross_spectrum=calibration)
    refitted: list[float] = []
    asked: list[tuple[int, int]] = []

    def fit(runs: object, vehicle: Vehicle, estimator: str) -> CalibratedVehicle:
        refitted.append(1.0)
        return calibrated

    def fresh(scope: Scope, seed: int, number: int) -> drives.FreshVan:
        asked.append((seed, number))
        seeds = np.random.SeedSequence([seed, number])
        van = drives.draw_van(number, np.random.default_rng(1))
        vehicle = replace(VAN, name=f"van {number}", payload_range_kg=(0.0, 420.0))
        return drives.FreshVan(van, REFERENCE, vehicle, runs, np.random.default_rng(seeds), seeds)

    monkeypatch.setattr(study, "calibrated_on", fit)
    monkeypatch.setattr(study, "fresh_van", fresh)
    monkeypatch.setattr(study, "driven", lambda *drive: runs[drive[5] % len(runs)])
    chosen = [next(one for one in CONSTANTS if one.acts is acts) for acts in Acts]
    van = study.of_one_van(3, 1, chosen)
    assert asked == [(3, 1)]
    assert len(refitted) == 1 + 2  # as it is, and what acts in calibration halved and doubled
    found = study.numbers(3, 2, [van, van], chosen)
    in_calibration, in_weighing, in_inspection = (one.name for one in chosen)
    assert {*found["weighing"]} == {
        "as it is", *(f"{name} x {by}" for name in (in_calibration, in_weighing) for by in ("0.5", "2"))
    }  # fmt: skip
    assert {*found["inspection"]} == {"as it is", f"{in_inspection} x 0.5", f"{in_inspection} x 2"}
    usual = found["inspection"]["as it is"]
    assert (usual["n_right"], usual["n_wrong"]) == (2 * (4 + 4), 2 * (1 + 4))
    assert usual["n_doubted"] == 0
    assert usual["n_named"] >= 8  # every sign; so little driving need not tell a label
    monkeypatch.setattr(Study, "run", lambda *_, **__: found)
    told = CliRunner().invoke(command.studies, ["sensitivity", "--output", str(tmp_path)], catch_exceptions=False)
    numbers = json.loads((tmp_path / "sensitivity.json").read_text(encoding="utf-8"))
    assert told.stdout == (tmp_path / "sensitivity.md").read_text(encoding="utf-8") == study.sensitivity_page(numbers)
    assert f"| `{in_calibration}` | 0.5 | " in told.stdout
    assert f"| as they are | 1 | 0 of 16 | {usual['n_named']} of 10 |" in told.stdout
