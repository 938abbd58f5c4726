"""A learner without a bus and without a process that learns: windows and results are the test's to give."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gateway.calibration.inspection.facts import RowFacts
from gateway.calibration.kept import KeptBatch
from gateway.calibration.learning.job import LearnJob, LearnResult
from gateway.config.sections import LearningSection
from gateway.core.batch_settings import BatchSettings
from gateway.records import Batch, iso_utc
from gateway.service.learner.learner import Learner
from gateway.service.learner.van import LearnerVehicle
from gateway.units import NS_PER_S
from support.calibrated import calibration_file

NOW_NS = 1_790_000_000 * NS_PER_S
WINDOW_S = 300
ANSWERS: dict[str, Any] = {
    "kerb_front_axle_kg": 690.0,
    "kerb_rear_axle_kg": 710.0,
    "wheelbase_m": 2.75,
    "sensor_position_m": 1.2,
    "gross_limit_kg": 2000.0,
}
VEHICLE = LearnerVehicle(id="van-17", name="van-17", signals_id="as mapped")


def at(seconds: float) -> str:
    """RFC 3339, so long after the begin of the bench's first drive."""
    return f"{iso_utc(NOW_NS + round(seconds * NS_PER_S))[:19]}Z"


def window(drive_s: float, begin_s: float, seconds: float = WINDOW_S) -> Batch:
    """Nobody fits it: a window of a drive that began at ``drive_s``."""
    n = round(seconds)
    rows = np.zeros(n)
    t_start_ns = NOW_NS + round(begin_s * NS_PER_S)
    return Batch(
        t_start_ns=t_start_ns,
        t_end_ns=t_start_ns + round(seconds * NS_PER_S),
        drive_start_ns=NOW_NS + round(drive_s * NS_PER_S),
        rate_hz=1.0,
        vertical_acceleration_mps2=rows,
        pitch_rate_radps=rows,
        speed_mps=rows + 14.0,
        usable=rows == 0.0,
        gravity_mps2=9.81,
        gap_share=0.0,
        shares={},
    )


def kept_window(drive_s: float, begin_s: float, seconds: float = WINDOW_S) -> KeptBatch:
    """The same as it is kept."""
    return KeptBatch(window(drive_s, begin_s, seconds), RowFacts())


class FakeDrives:
    """Where the bus is."""

    drive_start_ns: int | None = None
    newest_ns: int | None = None
    open_window_ns: tuple[int, int] | None = None


class FakeWorker:
    """Does nothing until told."""

    def __init__(self, on_result: Callable[[LearnJob, LearnResult], None]) -> None:
        self.job: LearnJob | None = None
        self.jobs: list[LearnJob] = []
        self._on_result = on_result

    @property
    def is_busy(self) -> bool:
        return self.job is not None

    def start(self, job: LearnJob) -> None:
        self.job = job
        self.jobs.append(job)

    def end(self) -> None:
        self.job = None

    def finish(self, result: LearnResult) -> None:
        """As if the process had found this."""
        job, self.job = self.job, None
        assert job is not None
        self._on_result(job, result)


class LearnerBench:
    """A learner in a directory, with all that is around it. Its thread is not started: ``turn`` does its work."""

    def __init__(self, directory: Path, vehicle: LearnerVehicle = VEHICLE, **settings: Any) -> None:
        self.directory = directory
        self.drives = FakeDrives()
        self.events: list[str] = []
        self.learner = Learner(
            directory,
            LearningSection(**settings),
            BatchSettings(window_s=WINDOW_S),
            self.drives,  # type: ignore[arg-type]  # as much of a Scheduler as is asked
            {},
            vehicle,
            on_event=lambda kind, detail: self.events.append(kind),
            clock_ns=lambda: NOW_NS,
            make_worker=self._make_worker,  # type: ignore[arg-type]  # likewise
        )

    def _make_worker(self, on_result: Callable[[LearnJob, LearnResult], None]) -> FakeWorker:
        self.worker = FakeWorker(on_result)
        return self.worker

    def drive(self, begin_s: float, seconds: float = WINDOW_S) -> None:
        """A drive of one window has been driven."""
        self.learner._files.add(kept_window(begin_s, begin_s, seconds), self.learner._is_stated)

    def turn(self) -> None:
        """One look whether there is something to learn."""
        self.learner._learn_if_due()

    def finish(self, plus_minus_kg: float = 40.0, payload_kg: float = 200.0, **more: Any) -> None:
        """The process that learns has made a calibration."""
        file = calibration_file(payload_kg)
        learning = {"plus_minus_kg": plus_minus_kg, "useful_at_kg": 150.0, "tested_on": 3, "helps": [], "findings": []}
        told = {"calibration": file.to_json(), "calibration_id": file.id, "learning": learning}
        self.worker.finish(LearnResult(**{**told, **more}))


def found(bench: LearnerBench, state: str, payload_kg: float = 298.0, question: str | None = None) -> dict[str, Any]:
    """What the process tells of the only statement of the job under way, and of its drive."""
    assert bench.worker.job is not None
    record = bench.worker.job.records[0].model_dump(mode="json", by_alias=True)
    told = {"state": state, "found": {"payload_kg": payload_kg, "plus_minus_kg": 40.0}, "question": question}
    drive = {"number": 1, "t_start": at(0), "t_end": at(300)}
    return {"statements": ({**record, "drives": [1], "reason": None, **told},), "drives": (drive,)}
