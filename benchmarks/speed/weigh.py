"""The cost of weighing: one batch of five minutes by each estimator, a calibration on ten drives of 15 minutes, and a
commissioning in the vehicle.

The batch is the demo's, with a roll rate; the campaign is the paper's experiment, simulated first. The commissioning is
the process that fits a quarter of an hour of empty driving, cut, stored and started as the service does it, with the
calibration of a sister vehicle as its line.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from benchmarks.speed.meter import CALIBRATION, ENVIRONMENT, best_of, cpu_s, springscale
from gateway.bus.signals import Decoder, SignalMap, load_signal_map
from gateway.calibration.campaign import CampaignTable, load_campaign
from gateway.calibration.commissioning.job import JOB, RESULT, Drive, Job, Result, to_file
from gateway.calibration.kept.batch_file import KeptBatch, kept_batch_of, packed
from gateway.config import ESTIMATOR_NAMES
from gateway.config.sections import CommissioningSection
from gateway.core.settings import BatchSettings
from gateway.estimate import Estimate
from gateway.offline.campaigns import batches_of_motion, read_whole_log
from gateway.records import Batch, Motion
from gateway.setup import load_setup
from gateway.toml_file import checked, read_toml
from gateway.weighing.estimator import estimate
from gateway.weighing.flow import Flow, Identity
from gateway.workbench.simulate import demo_drive, frames_of

PROGRAM: Final = (sys.executable, "-m", "gateway.calibration.commissioning.work")


def measure() -> dict[str, Any]:
    """Everything."""
    return {"batch_s": batch_s(), **fits()}


def batch_s() -> dict[str, float]:
    """CPU time of one estimate, by estimator: the mean over the batches of the demo's drive."""
    setup = load_setup("springscale:reference", CALIBRATION)
    motion = Decoder(setup.signal_map).decode(frames_of(demo_drive()))
    batches = [b for b in batches_of_motion(motion, setup.signal_map, BatchSettings()) if not b.is_provisional]
    sound = [batch for batch in batches if not batch.rejected]

    def weigh_all(name: str) -> dict[str, Any]:
        return {"counted": sum(estimate(batch, setup.calibrated, name).counted for batch in sound)}

    return {name: best_of(3, lambda name=name: weigh_all(name))["seconds"] / len(sound) for name in ESTIMATOR_NAMES}  # type: ignore[misc] # a default binds the loop's name


def fits() -> dict[str, dict[str, float]]:
    """CPU and clock time of `springscale calibrate` on ten drives, and of a commissioning on the vehicle's line."""
    with tempfile.TemporaryDirectory() as name:
        campaign, line = Path(name) / "campaign.toml", Path(name) / "vehicle.json"
        springscale("simulate", "campaign", "experiment", name)
        ran = springscale("calibrate", campaign, "--output", line)
        calibration = {what: ran[what] for what in ("cpu_s", "clock_s")}
        return {"calibration": calibration, "commissioning": commissioning(campaign, line, Path(name) / "job")}


def commissioning(campaign: Path, line: Path, folder: Path) -> dict[str, float]:
    """CPU time, clock and memory of the fit of the campaign's first drive, which is an empty one."""
    folder.mkdir()
    to_file(_job(campaign, line, folder), folder / JOB)
    begun_s = cpu_s()
    subprocess.run([*PROGRAM, str(folder)], check=True, env=os.environ | ENVIRONMENT)
    taken_s = cpu_s() - begun_s
    result = Result.model_validate_json((folder / RESULT).read_bytes())
    if result.calibration is None:
        raise SystemExit(f"the commissioning made no calibration: {result.fault or result.refusal}")
    return {"cpu_s": taken_s, "clock_s": result.seconds, "peak_mb": result.most_memory_mb}


def _job(campaign: Path, line: Path, folder: Path) -> Job:
    loaded, wanted = load_campaign(campaign), CommissioningSection()
    [first, *_] = loaded.runs
    if first.payload_kg:
        raise SystemExit(f"{campaign}: its first drive is not empty")
    signal_map = load_signal_map(loaded.signals)
    motion, _ = read_whole_log(loaded.log_of(first), signal_map)
    return Job(
        vehicle=checked(read_toml(campaign), campaign, CampaignTable).vehicle,
        drives=(
            Drive(
                name="empty drive",
                front_share_pct=loaded.front_share_pct(first),
                batches=tuple(_files(kept_of(motion, signal_map), folder)),
            ),
        ),
        settings=asdict(BatchSettings()),
        like=(line,),
        goal_std_share=wanted.goal_pct / 100.0,
        most_memory_mb=wanted.memory_mb,
        command="benchmark",
    )


def kept_of(motion: Motion, signal_map: SignalMap) -> list[KeptBatch]:
    """The batches that a service stores of these rows."""
    found: list[KeptBatch] = []
    flow = Flow(BatchSettings(), signal_map.traits, None, "cross_spectrum", Identity("van-17"))

    def keep(batch: Batch, estimate: Estimate, rows: Motion) -> None:
        if not batch.rejected and not batch.is_provisional:
            found.append(kept_batch_of(estimate.id, signal_map.id, batch, rows, signal_map.traits))

    flow.on_batch = keep
    for _ in (*flow.feed(motion), *flow.flush()):
        pass
    return found


def _files(batches: list[KeptBatch], folder: Path) -> Iterator[Path]:
    for number, kept in enumerate(batches):
        path = folder / f"{number}.batch"
        path.write_bytes(packed(kept))
        yield path
