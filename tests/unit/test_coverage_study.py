"""The coverage study puts every van to every kind of drive, and judges it on loads it was not calibrated with."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from support.calibrated import ratio_index_calibration
from support.half_car_road import batch_over_road

from benchmarks.accuracy import coverage, drives
from benchmarks.accuracy.coverage_table import coverage_table
from benchmarks.accuracy.drives import TRIPS, Scope, Trip
from gateway.calibration.stated_drive import StatedDrive, known_drive
from gateway.core.vehicle import Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.sim.instruments import Sensors
from gateway.sim.parameters import Load, front_share_pct, payload_kg
from gateway.sim.parameters import Vehicle as Van
from gateway.weighing.calibrated import CalibratedVehicle


def test_every_van_is_put_to_every_kind_of_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    """With stand-ins for driving and fitting: what is calibrated, what is judged, and what is refused."""
    calibrated_with: list[tuple[float, ...]] = []
    seeds: list[int] = []

    def stand_in(
        one: Van,
        loads: tuple[Load, ...],
        trip: Trip,
        scope: Scope,
        seed: np.random.SeedSequence,
        number: int,
        sensors: Sensors,
    ) -> StatedDrive:
        assert abs(sensors.mount.left_m) <= 0.4
        seeds.append(int(seed.generate_state(1)[0]))
        share_pct = front_share_pct(one, loads)
        batch = batch_over_road(100.0, 50.0, 1, duration_s=60.0, speed_mps=15.0)
        return known_drive(number, trip.kind, payload_kg(loads), share_pct, (batch,))

    def fit(runs: Sequence[StatedDrive], vehicle: Vehicle, estimator: str) -> CalibratedVehicle:
        if estimator == "cross_spectrum":
            raise CalibrationImpossibleError("not today")
        calibrated_with.append(tuple(run.payload_kg for run in runs))
        return CalibratedVehicle("x", vehicle, (0.0, 1e4), (0.0, 100.0), ratio_index_calibration())

    for module in (coverage, drives):
        monkeypatch.setattr(module, "driven", stand_in)
    monkeypatch.setattr(coverage, "calibrated_on", fit)
    done: list[tuple[int, int]] = []
    scope = Scope(n_known_loads=4, n_tests=3)
    study = replace(coverage.STUDY, of_case=partial(coverage.of_one_van, scope=scope))
    vans = study.cases(2, 11, on_done=lambda *step: done.append(step))
    batches, refused = ([one for of_van in vans for one in of_van[which]] for which in (0, 1))
    table = coverage_table(batches, 11, refused)
    assert len(calibrated_with) == 4  # each van with its roll rate, and without
    assert all(len(set(loads)) > 2 and loads[0] == 0.0 for loads in calibrated_with)
    assert {line["kind"] for line in table["lines"]} == {*TRIPS, "all"}
    assert {line["estimator"] for line in table["lines"]} == {"ratio_index"}
    *of_kinds, pooled, pooled_without = table["lines"]
    assert all(line["n_batches"] == 6 and line["n_vans"] == 2 for line in of_kinds)
    assert [line["has_roll_rate"] for line in of_kinds] == [True] * len(TRIPS) + [False] * len(TRIPS)
    assert [line["has_roll_rate"] for line in (pooled, pooled_without)] == [True, False]
    assert pooled["n_runs"] == pooled_without["n_runs"] == 2 * 3 * len(TRIPS)
    assert len(set(seeds)) == len(seeds) == 2 * (4 + 3 * len(TRIPS))  # no drive is driven twice
    assert [text.split(": ")[1:] for text in table["refused"]] == [
        ["cross_spectrum, with roll rate", "not today"],
        ["cross_spectrum, without roll rate", "not today"],
    ] * 2
    assert done == [(0, 2), (1, 2), (2, 2)]
