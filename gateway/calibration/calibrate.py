"""From inspected drives to a calibration file."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version

import numpy as np

from gateway.calibration.campaign import Campaign, file_sha256
from gateway.calibration.contradicted import contradictions
from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.file.parts import ExpectedErrorsPart, ProvenancePart, RunPart, SeenPart
from gateway.calibration.half_car.fit import CrossSpectrumFit, fit_cross_spectrum
from gateway.calibration.inheritance import Seen
from gateway.calibration.inspection.campaign import Inspection
from gateway.calibration.inspection.finding import Kind, Severity
from gateway.calibration.inspection.log import SplitRun
from gateway.calibration.known_run import KnownRun, sensor_rate_seen_hz
from gateway.calibration.ratio_index.bands import BandChoice
from gateway.calibration.ratio_index.fit import RatioIndexFit, fit_ratio_index
from gateway.calibration.sister import Sister, sister_of
from gateway.core.spectrum import roughness_mps2, spectra_of
from gateway.errors import CalibrationImpossibleError
from gateway.records import F64, Batch
from gateway.stated.doubt import Doubt

OnFit = Callable[[str, int, int], None]  # (estimator, steps done, steps in all)


@dataclass(frozen=True, slots=True)
class Outcome:
    """A calibration file with the data it was made from. None for an estimator without a result.

    ``doubts`` are of facts that the campaign states of the vehicle and that its drives contradict.
    """

    file: CalibrationFile
    inspection: Inspection
    ratio_index: RatioIndexFit | None = None
    cross_spectrum: CrossSpectrumFit | None = None
    doubts: tuple[Doubt, ...] = ()

    @property
    def split(self) -> tuple[SplitRun, ...]:
        """The runs without a fault, which were used for the calibration."""
        return self.inspection.usable


def calibrate_inspected(
    campaign: Campaign,
    inspection: Inspection,
    *,
    estimators: Sequence[str],
    bands: BandChoice = "campaign",
    like: CalibrationFile | None = None,
    command: str = "",
    on_fit: OnFit = lambda name, done, of: None,
) -> Outcome:
    """Fits every named estimator on the identification parts of the runs without a fault.

    ``like`` is the calibration of a vehicle of the same model: it replaces the prior of any vehicle.
    ``bands`` are the ratio index's: found on the campaign, or the paper's Table 2.

    An estimator that these runs do not determine is left out with a warning; raises CalibrationImpossibleError if none
    is left, or if the faults of the runs leave no valid calibration.
    """
    if inspection.refusal is not None:
        raise CalibrationImpossibleError(_refused(campaign, inspection, inspection.refusal))
    sister = sister_of(like) if like else None
    if sister is not None:
        inspection = inspection.excusing(Kind.ONE_LOAD_ONLY)
    split = inspection.usable
    runs = [one.identification for one in split]
    counted = [batch for run in runs for batch in run.batches if not batch.rejected]
    ratio_index, cross_spectrum, warnings = _fit(estimators, runs, campaign, sister, bands, on_fit)
    doubts = (
        contradictions(runs, campaign.vehicle, cross_spectrum.calibration, inherited=sister) if cross_spectrum else ()
    )
    warnings += [f"{one.kind}: {one.sentence}" for one in doubts]
    file = CalibrationFile(
        vehicle=campaign.vehicle,
        seen=_seen(runs, counted, sister.seen if sister and cross_spectrum else None),
        cross_spectrum=cross_spectrum.calibration if cross_spectrum else None,
        ratio_index=ratio_index.calibration if ratio_index else None,
        sister_id=sister.id if sister and cross_spectrum else None,
        expected_errors=_expected_errors(ratio_index=ratio_index, cross_spectrum=cross_spectrum),
        warnings=(*inspection.warnings, *warnings),
        provenance=_provenance(campaign, split, command),
    )
    return Outcome(file, inspection, ratio_index, cross_spectrum, doubts)


def _fit(
    estimators: Sequence[str],
    runs: Sequence[KnownRun],
    campaign: Campaign,
    sister: Sister | None,
    bands: BandChoice,
    on_fit: OnFit,
) -> tuple[RatioIndexFit | None, CrossSpectrumFit | None, list[str]]:
    """The result of each named estimator, and a warning for each that these runs do not determine."""
    ratio_index: RatioIndexFit | None = None
    cross_spectrum: CrossSpectrumFit | None = None
    warnings: list[str] = []
    for name in estimators:
        progress = partial(on_fit, name)
        try:
            if name == "ratio_index":
                ratio_index = fit_ratio_index(runs, campaign.vehicle, bands=bands, progress=progress)
            else:
                cross_spectrum = fit_cross_spectrum(runs, campaign.vehicle, progress, sister)
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


def _seen(runs: Sequence[KnownRun], counted: Sequence[Batch], of_sister: Seen | None) -> SeenPart:
    """The ranges covered by the runs with a batch, and by those of its sister."""
    driven = [run for run in runs if any(not batch.rejected for batch in run.batches)]
    return SeenPart(
        payload_kg=_span([*(run.payload_kg for run in driven), *(of_sister.payload_seen_kg if of_sister else ())]),
        front_share_pct=_span(
            [*(run.front_share_pct for run in driven), *(of_sister.front_share_seen_pct if of_sister else ())]
        ),
        speed_mps=_span([*(b.mean_speed_mps for b in counted), *(of_sister.speed_seen_mps if of_sister else ())]),
        roughness_mps2=_roughness_span(counted),
        sensor_rate_hz=sensor_rate_seen_hz(runs),
    )


def _span(numbers: Sequence[float]) -> tuple[float, float]:
    return min(numbers), max(numbers)


def _roughness_span(batches: Sequence[Batch]) -> tuple[float, float] | None:
    """None if no batch has an unbroken stretch for a spectrum."""
    roughness = [roughness_mps2(spectra_of(batch), batch.mean_speed_mps) for batch in batches]
    known = [one for one in roughness if math.isfinite(one)]
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
                sha256=one.log.sha256,
                payload_kg=one.identification.payload_kg,
                front_share_pct=one.identification.front_share_pct,
                payload_left_m=one.identification.payload_left_m,
                n_batches=len([batch for batch in one.identification.batches if not batch.rejected]),
            )
            for one in split
        ),
    )
