"""A commissioned vehicle and a desk for its tickets, without a bus and without processes that fit."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gateway.calibration.commissioning import Job, Planned, Result
from gateway.config.sections import CommissioningSection
from gateway.core.settings import BatchSettings
from gateway.records import iso_utc
from gateway.service.commissioning import Jobs
from gateway.service.proving.ticket_desk import TicketDesk
from gateway.service.tare_desk import Subject
from gateway.stated_weight import StatedWeight
from gateway.units import NS_PER_S
from gateway.web.routes.calibration.tickets import Ticket, TicketState
from support.calibrated import calibration_file
from support.commissioning import NOW_NS, WINDOW_S, Bench, FakeWorker, fitted, in_steps
from support.epochs import drive_of, stored

WINDOW_NS = WINDOW_S * NS_PER_S
PLANNED = Planned(
    payload_std_kg=30.0,
    front_share_std_pct=1.0,
    load_kg=300.0,
    load_position_m=2.1,
    then_payload_std_kg=12.0,
    then_front_share_std_pct=0.6,
    is_enough=False,
)


class TicketBench:
    """Drives of two windows each, ten windows apart; the first is the empty one that it was commissioned with."""

    def __init__(self, directory: Path, loads_kg: tuple[float, ...] = (270.0, 400.0)) -> None:
        self.directory = directory
        self.bench = Bench(directory)
        in_steps(self.bench)
        for n in range(2):
            self.bench.drive(n)
        self.bench.worker.finish(fitted(payload_kg=1.0))
        drives = []
        for i, payload_kg in enumerate(loads_kg, 1):
            for n in range(2):
                self.bench.drive(10 * i + n)
            drives.append(drive_of(2, payload_kg, start_ns=NOW_NS + 10 * i * WINDOW_NS))
        self.store = stored(directory / "store", *drives)
        self.events: list[str] = []
        self.restart()

    def restart(self) -> None:
        """As a new start of the service would; the process that fits is gone."""
        self.desk = TicketDesk(
            self.bench.desk.book,
            Jobs(self.directory, CommissioningSection(), BatchSettings(window_s=WINDOW_S)),
            self.bench.shelf,
            Subject(calibration_file().for_core(), "cross_spectrum", "van-17"),
            self.store.reader().estimates,
            on_event=lambda kind, detail: self.events.append(kind),
            make_worker=self._make_worker,  # type: ignore[arg-type]  # it is as much of a Worker as is asked
        )
        self.desk.start()

    def _make_worker(self, on_result: Callable[[Job, Result], None]) -> FakeWorker:
        self.worker = FakeWorker(self.directory, on_result)
        return self.worker

    def stated(self, i: int, payload_kg: float = 270.0, position_m: float | None = 1.4) -> StatedWeight:
        """Of the i-th loaded drive, stated for a moment within it."""
        return StatedWeight(
            iso_utc(NOW_NS + 10 * i * WINDOW_NS + WINDOW_NS // 2), payload_kg=payload_kg, position_m=position_m
        )

    def add(self, i: int, **stated: Any) -> dict[str, Any]:
        """Hand in a ticket of the i-th loaded drive."""
        text = self.desk.add("workshop", None, self.stated(i, **stated))
        Ticket.model_validate_json(text)  # the shape that the API promises
        made: dict[str, Any] = json.loads(text)
        return made

    def told(self) -> dict[str, Any]:
        text = self.desk.told()
        TicketState.model_validate_json(text)
        state: dict[str, Any] = json.loads(text)
        return state

    def finish(self, payload_kg: float, planned: Planned | None = PLANNED) -> None:
        """The fit under way ends with a calibration of its own."""
        self.worker.finish(fitted(payload_kg=payload_kg).model_copy(update={"planned": planned}))

    @property
    def active_id(self) -> str:
        """Of the calibration that counts from the next drive on."""
        active = self.bench.desk.book.record.active
        assert active is not None
        return active.id
