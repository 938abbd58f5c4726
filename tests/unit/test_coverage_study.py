"""The vans and drives of the coverage study, and that every van is judged on loads it was not calibrated with."""

from collections.abc import Sequence

import numpy as np
import pytest
from support.calibrated import ratio_index_calibration
from support.half_car_road import batch_over_road

from benchmarks.accuracy import coverage
from benchmarks.accuracy.coverage_drives import (
    AS_CALIBRATED,
    TRIPS,
    Scope,
    Trip,
    draw_van,
    driven,
    known_loads,
    stated,
    unseen_load,
)
from gateway.calibration.known_run import KnownRun
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.vehicle import Vehicle
from gateway.core.vehicle import front_share_pct as stated_share_pct
from gateway.errors import CalibrationImpossibleError
from gateway.sim.vehicle import Load, front_share_pct, payload_kg
from gateway.sim.vehicle import Vehicle as Van


def van(number: int = 1) -> Van:
    return draw_van(number, np.random.default_rng([7, number]))


def test_vans_differ_and_come_back_with_their_seed() -> None:
    assert van(0) == van(0)
    assert len({van(number).sprung_kg for number in range(6)}) == 6


def test_what_is_stated_gives_the_simulated_share() -> None:
    for number in range(3):
        one = van(number)
        for loads in known_loads(one, 6, np.random.default_rng(1))[1:]:
            found = stated_share_pct(stated(one), payload_kg(loads), loads[0].position_m)
            assert found == pytest.approx(front_share_pct(one, loads))


def test_known_loads_are_empty_first_then_all_different() -> None:
    loads = known_loads(van(), 6, np.random.default_rng(3))
    assert loads[0] == ()
    assert len(set(loads)) == 6
    assert len(known_loads(van(), 99, np.random.default_rng(3))) == 10  # the whole grid
    unseen = [unseen_load(van(), np.random.default_rng(seed)) for seed in range(60)]
    assert 0 < unseen.count(()) < 25
    assert all(payload_kg(one) <= van().rated_payload_kg for one in unseen)


def test_a_drive_becomes_batches_with_its_truth() -> None:
    scope = Scope(steady_s=310.0)
    loads = (Load(200.0, 1.2),)
    run = driven(van(), loads, AS_CALIBRATED, scope, np.random.SeedSequence([5]), 3)
    again = driven(van(), loads, AS_CALIBRATED, scope, np.random.SeedSequence([5]), 3)
    (counted,) = [batch for batch in run.batches if not batch.rejected]
    assert counted.mean_speed_mps == pytest.approx(50.0 / 3.6, rel=0.05)
    assert (run.number, run.payload_kg) == (3, 200.0)
    assert run.front_share_pct == pytest.approx(front_share_pct(van(), loads))
    assert np.array_equal(run.batches[0].pitch_rate_radps, again.batches[0].pitch_rate_radps)


def test_every_van_is_put_to_every_kind_of_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    """With stand-ins for driving and fitting: what is calibrated, what is judged, and what is refused."""
    calibrated_with: list[tuple[float, ...]] = []
    seeds: list[int] = []

    def drive(
        one: Van, loads: tuple[Load, ...], trip: Trip, scope: Scope, seed: np.random.SeedSequence, number: int
    ) -> KnownRun:
        seeds.append(int(seed.generate_state(1)[0]))
        share_pct = front_share_pct(one, loads)
        batch = batch_over_road(100.0, 50.0, 1, duration_s=60.0, speed_mps=15.0)
        return KnownRun(number, trip.kind, payload_kg(loads), share_pct, (batch,))

    def fit(runs: Sequence[KnownRun], vehicle: Vehicle, estimator: str) -> CalibratedVehicle:
        if estimator == "cross_spectrum":
            raise CalibrationImpossibleError("not today")
        calibrated_with.append(tuple(run.payload_kg for run in runs))
        return CalibratedVehicle("x", vehicle, (0.0, 1e4), (0.0, 100.0), ratio_index_calibration())

    monkeypatch.setattr(coverage, "driven", drive)
    monkeypatch.setattr(coverage, "calibrated_on", fit)
    done: list[tuple[int, int]] = []
    table = coverage.coverage(Scope(n_vans=2, n_known_loads=4, n_tests=3), 11, on_van=lambda *step: done.append(step))
    assert len(calibrated_with) == 2
    assert all(len(set(loads)) > 2 and loads[0] == 0.0 for loads in calibrated_with)
    assert {line.kind for line in table.lines} == {*TRIPS, "all"}
    assert {line.estimator for line in table.lines} == {"ratio_index"}
    assert all(line.n_batches == 6 and line.n_vans == 2 for line in table.lines[:-1])
    assert table.lines[-1].n_runs == 30
    assert len(set(seeds)) == len(seeds) == 2 * (4 + 15)  # no drive is driven twice
    assert [text.split(": ")[1:] for text in table.refused] == [["cross_spectrum", "not today"]] * 2
    assert done == [(0, 2), (1, 2), (2, 2)]
