"""The cost of weighing: one batch of five minutes by each estimator, a calibration on ten drives of 15 minutes, and the
learning in the vehicle.

The batches are of mixed driving, with a roll rate; the campaign is the paper's experiment; both are simulated first.
The learning is the process that learns from a quarter of an hour of empty driving, cut, stored and started as the
service does it, with the calibration of a sister vehicle.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import Any, Final

from benchmarks.speed.meter import CALIBRATION, ENVIRONMENT, best_of, cpu_s, springscale
from gateway.bus.signals import SignalMap, load_signal_map
from gateway.calibration.campaign_file import CampaignTable, load_campaign
from gateway.calibration.kept import KeptBatch, kept_batch_of, packed
from gateway.calibration.learning.job import JOB, RESULT, LearnJob, LearnResult
from gateway.config import ESTIMATOR_NAMES
from gateway.config.sections import LearningSection
from gateway.core.batch_settings import BatchSettings
from gateway.files.toml_file import checked, read_toml
from gateway.offline.campaigns import batches_of_motion, read_whole_log
from gateway.records import Batch, Motion, iso_utc
from gateway.setup import load_setup
from gateway.stated.statement import StatementRecord
from gateway.weighing.estimator import estimate
from gateway.weighing.flow import Flow, Identity

N_BATCHES: Final = 10
PROGRAM: Final = (sys.executable, "-m", "gateway.calibration.learning.work")


def measure() -> dict[str, Any]:
    """Everything."""
    return {"batch_s": batch_s(), **fits()}


def batch_s() -> dict[str, float]:
    """CPU time of one estimate, by estimator: the mean over ten batches of mixed driving with unknown loads."""
    setup = load_setup("springscale:reference", CALIBRATION)
    with tempfile.TemporaryDirectory() as name:
        springscale("simulate", "campaign", "mixed", name)
        sound = list(islice(_sound(Path(name) / "campaign.toml", setup.signal_map), N_BATCHES))

    def weigh_all(name: str) -> dict[str, Any]:
        return {"counted": sum(estimate(batch, setup.calibrated, name).counted for batch in sound)}

    return {name: best_of(3, lambda name=name: weigh_all(name))["seconds"] / len(sound) for name in ESTIMATOR_NAMES}  # type: ignore[misc] # a default binds the loop's name


def _sound(campaign: Path, signal_map: SignalMap) -> Iterator[Batch]:
    """The batches of a campaign's drives that can be weighed."""
    loaded = load_campaign(campaign)
    for run in loaded.runs:
        motion, _ = read_whole_log(loaded.log_of(run), signal_map)
        batches = batches_of_motion(motion, signal_map, BatchSettings())
        yield from (batch for batch in batches if not batch.is_provisional and not batch.rejected)


def fits() -> dict[str, dict[str, float]]:
    """CPU and clock time of `springscale calibrate` on ten drives, and of learning like a sister."""
    with tempfile.TemporaryDirectory() as name:
        campaign, like = Path(name) / "campaign.toml", Path(name) / "vehicle.json"
        springscale("simulate", "campaign", "experiment", name)
        ran = springscale("calibrate", campaign, "--output", like)
        calibration = {what: ran[what] for what in ("cpu_s", "clock_s")}
        return {"calibration": calibration, "learning": learning(campaign, like, Path(name) / "job")}


def learning(campaign: Path, like: Path, folder: Path) -> dict[str, float]:
    """CPU time, clock and memory of the fit of the campaign's first drive, which is an empty one."""
    folder.mkdir()
    (folder / JOB).write_text(_job(campaign, like, folder).model_dump_json(), encoding="utf-8")
    begun_s = cpu_s()
    subprocess.run([*PROGRAM, str(folder)], check=True, env=os.environ | ENVIRONMENT)
    taken_s = cpu_s() - begun_s
    result = LearnResult.model_validate_json((folder / RESULT).read_bytes())
    if result.calibration is None:
        raise SystemExit(f"nothing was learnt: {result.fault}")
    return {"cpu_s": taken_s, "clock_s": result.seconds, "peak_mb": result.most_memory_mb}


def _job(campaign: Path, like: Path, folder: Path) -> LearnJob:
    loaded = load_campaign(campaign)
    [first, *_] = loaded.runs
    if first.payload_kg:
        raise SystemExit(f"{campaign}: its first drive is not empty")
    signal_map = load_signal_map(loaded.signals)
    motion, _ = read_whole_log(loaded.log_of(first), signal_map)
    windows = kept_of(motion, signal_map)
    begin_ns = min(one.batch.t_start_ns for one in windows)
    empty = {"source": "empty", "from": iso_utc(begin_ns), "load": {"payload_kg": 0.0}}
    return LearnJob(
        key="benchmark",
        vehicle=checked(read_toml(campaign), campaign, CampaignTable).vehicle,
        windows=tuple(_files(windows, folder)),
        records=(StatementRecord.model_validate(empty),),
        settings=asdict(BatchSettings()),
        like=like,
        most_memory_mb=LearningSection().memory_mb,
    )


def kept_of(motion: Motion, signal_map: SignalMap) -> list[KeptBatch]:
    """The batches that a service stores of these rows."""
    found: list[KeptBatch] = []
    flow = Flow(BatchSettings(), signal_map.traits, None, "cross_spectrum", Identity("van-17"))

    def keep(batch: Batch, rows: Motion) -> None:
        if not batch.rejected and not batch.is_provisional:
            found.append(kept_batch_of(batch, rows, signal_map.traits))

    flow.on_window = keep
    for _ in (*flow.feed(motion), *flow.flush()):
        pass
    return found


def _files(batches: list[KeptBatch], folder: Path) -> Iterator[Path]:
    for number, kept in enumerate(batches):
        path = folder / f"{number}.batch"
        path.write_bytes(packed(kept))
        yield path
