"""Jobs for the process that fits: which batches, of which vehicle, with which prior."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from gateway.calibration.commissioning import Drive, Job
from gateway.config.sections import CommissioningSection
from gateway.core.settings import BatchSettings
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.service.commissioning.record import LineChoice
from gateway.units import NS_PER_S

COMMAND: Final = "commissioned on the vehicle"
EMPTY: Final = "empty drive"


@dataclass(frozen=True, slots=True)
class BatchFile:
    """A kept batch's file and its length."""

    path: Path
    t_start_ns: int
    t_end_ns: int

    @property
    def duration_s(self) -> float:
        """Of its window."""
        return (self.t_end_ns - self.t_start_ns) / NS_PER_S


@dataclass(frozen=True, slots=True)
class Jobs:
    """How jobs are made in one service."""

    directory: Path
    settings: CommissioningSection
    batch: BatchSettings

    def job(self, vehicle: Vehicle, line: LineChoice, batches: Sequence[BatchFile], *, is_fit: bool) -> Job:
        """Of an empty drive. A window that a power cut ended early is no shorter than it could be."""
        window_s = min(self.batch.window_s, max(one.duration_s for one in batches))
        return Job(
            vehicle=vehicle,
            drives=(
                Drive(
                    name=EMPTY,
                    front_share_pct=front_share_pct(vehicle, 0.0, None),
                    batches=tuple(one.path for one in batches),
                ),
            ),
            settings=asdict(self.batch) | {"window_s": window_s},
            like=() if line.copy_name is None else (self.directory / line.copy_name,),
            is_fit=is_fit,
            goal_std_share=self.settings.goal_pct / 100.0,
            most_memory_mb=self.settings.memory_mb,
            command=COMMAND,
        )
