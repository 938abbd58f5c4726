"""Made-up loads about a limit, whole batches as the flow would give them; and a desk of alarms that hears of them."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from gateway.core.alarms.rules import AlarmRules
from gateway.core.fusion import epoch_of
from gateway.core.vehicle import Vehicle
from gateway.core.weights.on_the_road import weighed
from gateway.estimates.as_json import estimate_to_json
from gateway.estimates.batch_estimate import Estimate
from gateway.service.alarm_reader import AlarmService
from gateway.setup import Subject
from gateway.store import Store
from gateway.web.live.board import Board
from gateway.weighing.calibrated import CalibratedVehicle
from support.days import at, batch
from support.estimates import posterior_of

VAN = Vehicle(
    name="van",
    empty_mass_kg=1600.0,
    wheelbase_m=3.0,
    sensor_position_m=0.0,
    track_width_m=1.5,
    unsprung_front_kg=100.0,
    unsprung_rear_kg=100.0,
    gross_limit_kg=2500.0,
    rear_axle_limit_kg=1500.0,
)
LIMIT_KG = 700.0  # of payload: what makes the gross weight the permitted one


def of_load(
    n: int,
    kg: float,
    load_kg: float | None = None,
    *,
    share_pct: float = 50.0,
    n_batches: int = 1,
    std_kg: float = 14.0,
    cg_left_m: float | None = None,
) -> Estimate:
    """The n-th batch of five minutes, and what ``n_batches`` of its load found together."""
    found = batch(5.0 * n, 5.0 * (n + 1), kg, share_pct).answered(posterior_of(kg, share_pct, std_kg, 0.5, cg_left_m))
    together_kg, together_std_kg = kg if load_kg is None else load_kg, std_kg if n_batches == 1 else 0.8 * std_kg
    together = posterior_of(together_kg, share_pct, together_std_kg, 0.5, cg_left_m)
    return weighed(replace(found, epoch=epoch_of(together, n_batches)), VAN)


SUBJECT = Subject(CalibratedVehicle("sha256:1", VAN, (0.0, 900.0), (40.0, 60.0)), "cross_spectrum", "van-17")


class AlarmBench:
    """A desk over a real store, without a pipeline; ``clock_s`` is the test's to set, the wall clock follows it."""

    def __init__(self, directory: Path, rules: AlarmRules | None = None) -> None:
        self.directory, self.rules = directory, rules or AlarmRules()
        self.clock_s = 0.0
        self.start()

    def start(self) -> None:
        """Makes a new desk over the store, as a restart of the service does."""
        self.store, self.board = Store.open(self.directory), Board()
        self.desk = AlarmService(self.rules, SUBJECT, self.store, lambda: at(self.clock_s / 60.0), lambda: self.clock_s)

    def restart(self) -> None:
        self.store.close()
        self.start()

    def weigh(self, found: Estimate) -> None:
        """Hands a batch to the desk as the pipeline does."""
        self.store.write_estimate(estimate_to_json(found))
        self.desk(found)

    def standing(self) -> list[dict[str, Any]]:
        return json.loads(self.desk.standing())

    def history(self) -> list[dict[str, Any]]:
        return [json.loads(text) for text in self.store.reader().entries(kind="alarm", limit=1000).items]
