"""The experiments of the paper's section 4: simulated campaigns, calibrations and judged batches."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from gateway.calibration.campaign_file import Campaign, file_sha256, load_campaign
from gateway.calibration.from_drives import calibrate_inspected
from gateway.calibration.inspection.facts import InspectedRun
from gateway.calibration.judgement.evaluation import TARGETS, Errors, Judged, errors_of, judge
from gateway.calibration.ratio_index.index_fit import fit_ratio_index
from gateway.calibration.ratio_index.spectra_table import index_rows
from gateway.calibration.stated_drive import StatedDrive
from gateway.config import ESTIMATOR_NAMES
from gateway.core.batch_settings import BatchSettings
from gateway.core.ratio_index.index import RatioIndexCalibration
from gateway.offline.campaigns import inspect, split_runs
from gateway.weighing.calibrated import CalibratedVehicle
from gateway.workbench.simulated_drives import bench_of, write_campaign

OnStep = Callable[[str, int, int], None]  # (what is being done, steps done, steps in all)

CAMPAIGNS: Final = (
    "load-sweep", "share-sweep", "ident", "test1", "test2", "test3", "sensitivity", "experiment", "speeds",
)  # fmt: skip
RATIO_INDEX: Final = "ratio_index"
N_STEPS: Final = 2 * len(CAMPAIGNS) + 3  # drive and read each, calibrate twice, judge and draw


@dataclass(frozen=True, slots=True)
class Extent:
    """How much is simulated. The defaults are the paper's; smaller values are for trials."""

    seed: int = 1
    window_s: float = 300.0
    longest_s: float = math.inf
    workers: int = 1

    @property
    def is_whole(self) -> bool:
        """False if drives or batches are shorter than the paper's."""
        return self == Extent(self.seed, workers=self.workers)

    @property
    def settings(self) -> BatchSettings:
        return BatchSettings(window_s=self.window_s)


@dataclass(frozen=True, slots=True)
class DrivenCampaign:
    """One campaign with its batches."""

    campaign: Campaign
    splits: tuple[InspectedRun, ...]

    @property
    def identification(self) -> list[StatedDrive]:
        return [split.identification for split in self.splits if split.identification.batches]

    @property
    def validation(self) -> list[StatedDrive]:
        return [split.validation for split in self.splits if split.validation.batches]

    @property
    def runs(self) -> list[StatedDrive]:
        return [*self.identification, *self.validation]


@dataclass(frozen=True, slots=True)
class Method:
    """One method: its display name, the estimator and the calibrated vehicle."""

    label: str
    estimator: str
    calibrated: CalibratedVehicle

    def judge(self, runs: Sequence[StatedDrive]) -> list[Judged]:
        return judge(runs, self.calibrated, self.estimator)


@dataclass(frozen=True, slots=True)
class Experiments:
    """Campaigns by kind; the methods calibrated on the paper's simulated grid, and those on the experiment."""

    extent: Extent
    driven: Mapping[str, DrivenCampaign]
    simulated: tuple[Method, ...]
    experimental: tuple[Method, ...]

    @property
    def ratio_index(self) -> RatioIndexCalibration:
        """The ratio index calibrated on the simulated grid. Raises ValueError if there is none."""
        method = self.simulated[0]
        if method.calibrated.ratio_index is None:
            raise ValueError(f"{method.label}: holds no ratio index")
        return method.calibrated.ratio_index

    def errors(self, kind: str, split: str, method: Method) -> Errors:
        """The errors (12) of one method over one split of a campaign."""
        driven = self.driven[kind]
        runs = driven.identification if split == "identification" else driven.validation
        return errors_of(method.judge(runs), driven.campaign.vehicle)


def gather(output: Path, extent: Extent, on_step: OnStep = lambda what, done, of: None) -> Experiments:
    """Simulate every campaign into output/campaigns, calibrate, and split all drives into batches."""
    driven = {}
    for number, kind in enumerate(CAMPAIGNS):
        on_step(f"driving {kind}", 2 * number, N_STEPS)
        bench = bench_of(kind, seed=extent.seed, longest_s=extent.longest_s)
        path = write_campaign(bench, output / "campaigns" / kind, workers=extent.workers)
        on_step(f"reading {kind}", 2 * number + 1, N_STEPS)
        campaign = load_campaign(path)
        driven[kind] = DrivenCampaign(campaign, tuple(split_runs(campaign, extent.settings)))
    on_step("calibrating on the simulated grid", N_STEPS - 3, N_STEPS)
    simulated = _methods(driven["ident"], extent, output / "vehicle_simulated.json")
    on_step("calibrating on the experiment", N_STEPS - 2, N_STEPS)
    experimental = _methods(driven["experiment"], extent, output / "vehicle_experiment.json")
    return Experiments(extent, driven, simulated, experimental)


def _methods(driven: DrivenCampaign, extent: Extent, path: Path) -> tuple[Method, ...]:
    """Every estimator calibrated on the identification part, and the ratio index with the bands of Table 2."""
    campaign = driven.campaign
    held = calibrate_inspected(
        campaign.vehicle,
        inspect(campaign, extent.settings),
        where=str(campaign.path),
        sha256=file_sha256(campaign.path),
        estimators=ESTIMATOR_NAMES,
        command="springscale reproduce",
    ).file
    path.write_text(held.to_json(), encoding="utf-8")
    calibrated = held.for_core()
    others = [name for name in held.estimators if name != RATIO_INDEX]
    return (
        Method("ratio index", RATIO_INDEX, calibrated),
        Method("ratio index, bands of the paper's Table 2", RATIO_INDEX, with_paper_bands(calibrated, driven)),
        *(Method(name.replace("_", " "), name, calibrated) for name in others),
    )


def with_paper_bands(calibrated: CalibratedVehicle, driven: DrivenCampaign) -> CalibratedVehicle:
    """The vehicle with the bands of Table 2 and the regressions fitted to them."""
    if calibrated.ratio_index is None:
        return calibrated
    fit = fit_ratio_index(driven.identification, driven.campaign.vehicle, bands="table2")
    return replace(calibrated, ratio_index=fit.calibration)


def condition_of(run: StatedDrive) -> str:
    """ "08_L225_D50.0_50kmh_iri2/can.log.gz" -> "50kmh iri2"."""
    return " ".join(run.log.split("/", maxsplit=1)[0].split("_")[3:])


def mean_errors(run: StatedDrive, method: Method) -> tuple[float, float]:
    """Mean error of payload [kg] and share [points] over a run's batches, with the ratio index's gates disabled."""
    if method.estimator == RATIO_INDEX and method.calibrated.ratio_index is not None:
        calibration = method.calibrated.ratio_index
        rows = index_rows([run], calibration)
        models = (calibration.payload, calibration.front_share)
        errors = [
            [m.predict(a, g)[0] - true if m else np.nan for m, true in zip(models, truth, strict=True)]
            for a, g, *truth in zip(rows.ra, rows.rg, rows.payload_kg, rows.front_share_pct, strict=True)
        ]
    else:
        errors = [
            [one.compared(target).estimated - one.compared(target).true for target in TARGETS]
            for one in method.judge([run])
            if one.estimate.counted
        ]
    payload_kg, share_pp = np.mean(errors, axis=0).tolist() if errors else (np.nan, np.nan)
    return payload_kg, share_pp
