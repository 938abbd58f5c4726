"""From a campaign file to a calibration file, and from both to the error table of (12)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from typing import Any, Literal

import numpy as np

from gateway.calibration.campaign import Campaign
from gateway.calibration.evaluation import Judged, error_table
from gateway.calibration.file import (
    CalibrationFile,
    CrossSpectrumPart,
    ExpectedErrorsPart,
    ProvenancePart,
    RatioIndexPart,
    RunPart,
    SeenPart,
    VehiclePart,
)
from gateway.calibration.grey_box import CrossSpectrumFit, fit_cross_spectrum
from gateway.calibration.index_choice import BandChoice
from gateway.calibration.inspection import Finding, RunVerdict, Severity
from gateway.calibration.ratio_index_fit import RatioIndexFit, fit_ratio_index
from gateway.calibration.structures import StructureChoice
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.cross_spectrum.estimator import CrossSpectrumCalibration
from gateway.core.estimator import estimate
from gateway.core.known_run import KnownRun
from gateway.core.settings import BatchSettings
from gateway.core.spectrum import roughness_mps2, spectra_of
from gateway.errors import CalibrationImpossibleError
from gateway.offline.inspect import Inspection, inspect
from gateway.offline.known_runs import OnRun, SplitRun, file_sha256, split_runs
from gateway.records import F64, Batch

Split = Literal["identification", "validation", "all"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """A calibration file with all that stands behind it. What no estimator gave is None.

    verdicts are of every run, split holds those without a fault, which calibrated; campaign_findings are of
    all together. cross_spectrum_without holds, by run number, what the other runs teach without that run.
    """

    file: CalibrationFile
    verdicts: tuple[RunVerdict, ...]
    split: tuple[SplitRun, ...]
    ratio_index: RatioIndexFit | None
    cross_spectrum: CrossSpectrumCalibration | None
    cross_spectrum_without: Mapping[int, CrossSpectrumCalibration] = field(default_factory=dict)
    campaign_findings: tuple[Finding, ...] = ()


def calibrate(
    campaign: Campaign,
    settings: BatchSettings,
    *,
    estimators: Sequence[str],
    numbers: Sequence[int] | None = None,
    bands: BandChoice = "campaign",
    structure: StructureChoice = "auto",
    command: str = "",
    on_run: OnRun = lambda done, of: None,
) -> Outcome:
    """Inspects the chosen runs and fits every named estimator on the identification parts of those without a fault.

    Raises as :func:`calibrate_inspected` does.
    """
    inspection = inspect(campaign, settings, numbers=numbers, on_run=on_run)
    return calibrate_inspected(
        campaign, inspection, estimators=estimators, bands=bands, structure=structure, command=command
    )


def calibrate_inspected(
    campaign: Campaign,
    inspection: Inspection,
    *,
    estimators: Sequence[str],
    bands: BandChoice = "campaign",
    structure: StructureChoice = "auto",
    command: str = "",
) -> Outcome:
    """Fits every named estimator on the identification parts of the runs without a fault.

    ``bands`` and ``structure`` are the ratio index's: found on the campaign, or named.

    An estimator that these runs cannot carry is left out with a warning; raises CalibrationImpossibleError
    when none is left, and where the faults of the runs leave no calibration worth its name.
    """
    if inspection.refusal is not None:
        raise CalibrationImpossibleError(_refused(campaign, inspection, inspection.refusal))
    split = inspection.usable
    runs = [one.identification for one in split]
    counted = [batch for run in runs for batch in run.batches if not batch.rejected]
    ratio_index, cross_spectrum, warnings = _fit(estimators, runs, campaign, bands, structure)
    with_batches = [run for run in runs if any(not batch.rejected for batch in run.batches)]
    speeds = [batch.mean_speed_mps for batch in counted]
    file = CalibrationFile(
        vehicle=VehiclePart(**asdict(campaign.vehicle)),
        seen=SeenPart(
            payload_kg=_span([run.payload_kg for run in with_batches]),
            front_share_pct=_span([run.front_share_pct for run in with_batches]),
            speed_mps=_span(speeds),
            roughness_mps2=_roughness_span(counted),
        ),
        cross_spectrum=CrossSpectrumPart.of(cross_spectrum.calibration) if cross_spectrum else None,
        ratio_index=RatioIndexPart.of(ratio_index.calibration) if ratio_index else None,
        expected_errors=_expected_errors(ratio_index=ratio_index, cross_spectrum=cross_spectrum),
        warnings=(*inspection.warnings, *warnings),
        provenance=_provenance(campaign, split, command),
    )
    return Outcome(
        file,
        inspection.verdicts,
        split,
        ratio_index,
        cross_spectrum.calibration if cross_spectrum else None,
        cross_spectrum.without if cross_spectrum else {},
        inspection.findings,
    )


def _fit(
    estimators: Sequence[str],
    runs: Sequence[KnownRun],
    campaign: Campaign,
    bands: BandChoice,
    structure: StructureChoice,
) -> tuple[RatioIndexFit | None, CrossSpectrumFit | None, list[str]]:
    """What each named estimator learned, and a warning for each that these runs cannot carry."""
    ratio_index: RatioIndexFit | None = None
    cross_spectrum: CrossSpectrumFit | None = None
    warnings: list[str] = []
    for name in estimators:
        try:
            if name == "ratio_index":
                ratio_index = fit_ratio_index(runs, campaign.vehicle, bands=bands, structure=structure)
            else:
                cross_spectrum = fit_cross_spectrum(runs, campaign.vehicle)
                warnings.extend(cross_spectrum.calibration.warnings)
        except CalibrationImpossibleError as fault:
            warnings.append(f"{name}: {fault}")
    if ratio_index is None and cross_spectrum is None:
        raise CalibrationImpossibleError(f"{campaign.path}: " + "; ".join(warnings))
    return ratio_index, cross_spectrum, warnings


def _refused(campaign: Campaign, inspection: Inspection, why: str) -> str:
    """The refusal with every fault that led to it."""
    faults = [
        f"run {verdict.number}: {finding.kind}: {finding.text}: {finding.advice}"
        for verdict in inspection.verdicts
        for finding in verdict.findings
        if finding.severity is Severity.FAULT
    ]
    return "\n".join([f"{campaign.path}: {why}", *dict.fromkeys(faults)])


def _span(found: Sequence[float]) -> tuple[float, float]:
    return min(found), max(found)


def _roughness_span(batches: Sequence[Batch]) -> tuple[float, float] | None:
    """None where no batch holds an unbroken stretch for a spectrum."""
    found = [roughness_mps2(spectra_of(batch), batch.mean_speed_mps) for batch in batches]
    known = [one for one in found if math.isfinite(one)]
    return _span(known) if known else None


def _expected_errors(**fits: RatioIndexFit | CrossSpectrumFit | None) -> dict[str, ExpectedErrorsPart]:
    return {
        name: ExpectedErrorsPart(
            payload_rms_kg=_rms(fit.payload_errors_kg), front_share_rms_pct=_rms(fit.front_share_errors_pct)
        )
        for name, fit in fits.items()
        if fit is not None
    }


def _rms(errors: F64 | None) -> float | None:
    return None if errors is None else float(np.sqrt(np.mean(errors**2)))


def _provenance(campaign: Campaign, split: Sequence[SplitRun], command: str) -> ProvenancePart:
    return ProvenancePart(
        software=f"springscale {version('springscale')}",
        command=command,
        campaign_sha256=file_sha256(campaign.path),
        runs=tuple(
            RunPart(
                number=one.identification.number,
                log=one.identification.name,
                sha256=one.sha256,
                payload_kg=one.identification.payload_kg,
                front_share_pct=one.identification.front_share_pct,
                n_batches=len([batch for batch in one.identification.batches if not batch.rejected]),
            )
            for one in split
        ),
    )


def evaluate(
    campaign: Campaign,
    calibrated: CalibratedVehicle,
    settings: BatchSettings,
    *,
    estimator: str,
    split: Split = "validation",
    on_run: OnRun = lambda done, of: None,
) -> dict[str, Any]:
    """The error table of (12) over one part of every run, normalised by the campaign's ranges.

    Raises as :func:`judge_campaign` does.
    """
    judged = judge_campaign(campaign, calibrated, settings, estimator=estimator, split=split, on_run=on_run)
    return error_table(judged, campaign.vehicle, estimator)


def judge_campaign(
    campaign: Campaign,
    calibrated: CalibratedVehicle,
    settings: BatchSettings,
    *,
    estimator: str,
    split: Split = "validation",
    on_run: OnRun = lambda done, of: None,
) -> list[Judged]:
    """Every batch of one part of every run with its estimate.

    Raises CalibrationImpossibleError where that part holds no batch, for then there is nothing to judge.
    """
    runs = split_runs(campaign, settings, on_run=on_run)
    judged = [one for run in runs for part in _parts(run, split) for one in judge(part, calibrated, estimator)]
    if not judged:
        raise CalibrationImpossibleError(
            f"{campaign.path}: the {split} part of its runs holds no batch: identification_fraction "
            f"{campaign.identification_fraction:g} and the runs' split leave nothing to evaluate"
        )
    return judged


def _parts(run: SplitRun, split: Split) -> list[KnownRun]:
    parts = {"identification": [run.identification], "validation": [run.validation]}
    return parts.get(split, [run.identification, run.validation])


def judge(run: KnownRun, calibrated: CalibratedVehicle, estimator: str) -> list[Judged]:
    """Every batch of a known run with its estimate."""
    return [
        Judged(run.number, run.name, run.payload_kg, run.front_share_pct, estimate(batch, calibrated, estimator))
        for batch in run.batches
    ]
