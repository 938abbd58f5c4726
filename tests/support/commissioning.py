"""A commissioning without a bus and without a process that fits: batches and results are the test's to give."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gateway.calibration.commissioning.job import Job, Learned, Result
from gateway.calibration.inspection.rows import RowFacts
from gateway.calibration.kept.batch_file import KeptBatch
from gateway.calibration.kept.shelf import Shelf, ShelfLimits
from gateway.config.sections import CommissioningSection
from gateway.core.settings import BatchSettings
from gateway.records import Batch, Why
from gateway.service.commissioning.empty_drive import ServiceVehicle
from gateway.service.commissioning.session import Commissioning
from gateway.stated.facts import VehicleAnswers
from gateway.units import NS_PER_S
from support.calibrated import calibration_file

NOW_NS = 1_790_000_000 * NS_PER_S
WINDOW_S = 300
ANSWERS: dict[str, Any] = {
    "kerb_front_axle_kg": 690.0,
    "kerb_rear_axle_kg": 710.0,
    "wheelbase_m": 2.75,
    "sensor_position_m": 1.2,
}
VEHICLE = ServiceVehicle(name="van-17", signals_id="as mapped", is_calibrated=False)


class FakeDrives:
    """Where the bus is."""

    drive_start_ns: int | None = None
    newest_ns: int | None = None
    open_window_ns: tuple[int, int] | None = None


class FakeWorker:
    """Does nothing until told."""

    def __init__(self, directory: Path, on_result: Callable[[Job, Result], None]) -> None:
        self.folder = directory / "commissioning"
        self.job: Job | None = None
        self.jobs: list[Job] = []
        self._on_result = on_result

    @property
    def is_busy(self) -> bool:
        return self.job is not None

    def start(self, job: Job, files: Mapping[str, bytes]) -> None:
        self.job = job
        self.jobs.append(job)

    def end(self) -> None:
        self.job = None

    def finish(self, result: Result) -> None:
        """As if the process had found this."""
        job, self.job = self.job, None
        assert job is not None
        self.tell(job, result)

    def tell(self, job: Job, result: Result) -> None:
        """As if this had come of any job, only now."""
        self._on_result(job, result)


class Bench:
    """A desk in a directory, with all that is around it."""

    def __init__(
        self,
        directory: Path,
        vehicle: ServiceVehicle = VEHICLE,
        **settings: Any,
    ) -> None:
        self.directory = directory
        self.drives = FakeDrives()
        self.events: list[str] = []
        self.shelf = Shelf(directory / "batches", ShelfLimits())
        self.settings = CommissioningSection(**settings)
        self.desk = Commissioning(
            directory,
            self.settings,
            BatchSettings(window_s=WINDOW_S),
            self.shelf,
            self.drives,
            vehicle,
            on_event=lambda kind, detail: self.events.append(kind),
            clock_ns=lambda: NOW_NS,
            make_worker=self._make_worker,  # type: ignore[arg-type]  # it is as much of a Worker as is asked
        )

    def _make_worker(self, on_result: Callable[[Job, Result], None]) -> FakeWorker:
        self.worker = FakeWorker(self.directory, on_result)
        return self.worker

    def drive(self, n: int, seconds: int = WINDOW_S, *rejected: Why, is_provisional: bool = False) -> KeptBatch:
        """The n-th window goes by."""
        kept = kept_batch(n, seconds, *rejected, is_provisional=is_provisional)
        if not is_provisional and not rejected:
            self.shelf.add(kept)
        self.desk.hear(kept)
        return kept


def kept_batch(n: int, seconds: int = WINDOW_S, *rejected: Why, is_provisional: bool = False) -> KeptBatch:
    """Nobody fits it."""
    rows = np.zeros(10)
    t_start_ns = NOW_NS + n * WINDOW_S * NS_PER_S
    t_end_ns = t_start_ns + seconds * NS_PER_S
    batch = Batch(
        t_start_ns=t_start_ns,
        t_end_ns=t_end_ns,
        drive_start_ns=NOW_NS,
        rate_hz=50.0,
        vertical_acceleration_mps2=rows,
        pitch_rate_radps=rows,
        speed_mps=rows,
        usable=rows == 0.0,
        gravity_mps2=9.81,
        gap_share=0.0,
        shares={},
        rejected=rejected,
        is_provisional=is_provisional,
    )
    return KeptBatch(f"{t_end_ns}-{n:012x}", "as mapped", batch, RowFacts())


def learned(payload_std_kg: float, needed_std_kg: float = 18.0) -> Learned:
    return Learned(payload_std_kg=payload_std_kg, front_share_std_pct=0.5, needed_std_kg=needed_std_kg)


def fitted(payload_std_kg: float = 15.0, **vehicle: Any) -> Result:
    """A calibration that can be loaded."""
    file = calibration_file(**vehicle)
    return Result(learned=learned(payload_std_kg), calibration=file.to_json(), calibration_id=file.id)


def in_steps(bench: Bench, *, until: str = "drive") -> None:
    """As far as a step."""
    bench.desk.begin("workshop", None)
    if until == "vehicle":
        return
    bench.desk.state_vehicle(VehicleAnswers(**ANSWERS))
    if until != "empty":
        bench.desk.is_empty("workshop")


def replaced(vehicle: ServiceVehicle = VEHICLE, **changes: Any) -> ServiceVehicle:
    """Another vehicle."""
    return replace(vehicle, **changes)
