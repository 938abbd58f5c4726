"""From inspected drives to a calibration file, for campaigns of known loads as for ordinary drives."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version

import numpy as np

from gateway.calibration.contradicted import contradictions
from gateway.calibration.file import CalibrationFile, DrivePart, ExpectedErrorsPart, FoundPart, ProvenancePart, SeenPart
from gateway.calibration.found import ClaimState, FoundClaim, FoundLoad, Taught
from gateway.calibration.inspection.across_runs import Inspection
from gateway.calibration.inspection.facts import InspectedRun
from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.calibration.ratio_index.bands import BandChoice
from gateway.calibration.ratio_index.index_fit import RatioIndexFit, fit_ratio_index
from gateway.calibration.sister import require_alike, sister_in
from gateway.calibration.stated_drive import StatedDrive, sensor_rate_seen_hz
from gateway.calibration.teach import examined, teach
from gateway.core.spectrum import roughness_mps2, spectra_of
from gateway.core.vehicle import Load, Vehicle
from gateway.errors import CalibrationImpossibleError
from gateway.estimates.quantity import Z95
from gateway.model.vehicle_model import VehicleModel
from gateway.records import F64, FIRST_DATED_NS, iso_utc
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
    cross_spectrum: Taught | None = None
    doubts: tuple[Doubt, ...] = ()


def calibrate_inspected(
    vehicle: Vehicle,
    inspection: Inspection,
    *,
    where: str,
    sha256: str,
    estimators: Sequence[str],
    bands: BandChoice = "campaign",
    like: CalibrationFile | None = None,
    command: str = "",
    on_fit: OnFit = lambda name, done, of: None,
) -> Outcome:
    """Fits every named estimator on the identification parts of the runs without a fault.

    ``like`` is the calibration of a vehicle of the same model: it replaces the prior of any vehicle.
    ``bands`` are the ratio index's: found on these drives, or the paper's Table 2. ``where`` names in messages what
    states the vehicle, a campaign file for instance; ``sha256`` is of its content.

    An estimator that these runs do not determine is left out with a warning; raises CalibrationImpossibleError if none
    is left, or if the faults of the runs leave no valid calibration.
    """
    if inspection.refusal is not None:
        faults = [
            f"run {run.run.number}: {one.kind}: {one.text}: {one.advice}"
            for run in inspection.runs
            for one in run.findings
            if one.severity is Severity.FAULT
        ]
        refusal = f"{where}: {inspection.refusal}"
        raise CalibrationImpossibleError("\n".join([refusal, *dict.fromkeys(faults)]))
    sister = None
    if like is not None:
        sister = sister_in(like)
        require_alike(like.vehicle, vehicle)
        inspection = inspection.excusing(Kind.ONE_LOAD_ONLY)
    split = inspection.usable
    runs = [one.identification for one in split]
    ratio_index, cross_spectrum, claims, warnings = _fit(estimators, runs, vehicle, sister, bands, on_fit)
    if ratio_index is None and cross_spectrum is None:
        raise CalibrationImpossibleError(f"{where}: " + "; ".join(warnings))
    inspection = _with_disagreements(inspection, claims)
    inspection = _as_believed(inspection, claims, cross_spectrum)
    believed = [one.identification for one in inspection.usable]
    doubts = contradictions(believed, vehicle, cross_spectrum.model, sister) if cross_spectrum else ()
    warnings += [f"{one.kind}: {one.sentence}" for one in doubts]
    file = CalibrationFile(
        vehicle=vehicle,
        seen=_seen(runs, cross_spectrum),
        cross_spectrum=cross_spectrum.model if cross_spectrum else None,
        ratio_index=ratio_index.calibration if ratio_index else None,
        sister_id=like.id if like and cross_spectrum else None,
        expected_errors=_expected_errors(ratio_index, cross_spectrum),
        warnings=(*inspection.warnings, *warnings),
        provenance=_provenance(sha256, split, cross_spectrum, command),
    )
    return Outcome(file, inspection, ratio_index, cross_spectrum, doubts)


def _fit(
    estimators: Sequence[str],
    runs: Sequence[StatedDrive],
    vehicle: Vehicle,
    sister: VehicleModel | None,
    bands: BandChoice,
    on_fit: OnFit,
) -> tuple[RatioIndexFit | None, Taught | None, tuple[FoundClaim, ...], list[str]]:
    """The result of each named estimator, the statements tested, and a warning for each estimator that these runs do
    not determine.
    """
    ratio_index: RatioIndexFit | None = None
    cross_spectrum: Taught | None = None
    warnings: list[str] = []
    if "cross_spectrum" in estimators:
        try:
            cross_spectrum = teach(runs, vehicle, sister, partial(on_fit, "cross_spectrum"))
            warnings.extend(cross_spectrum.model.warnings)
        except CalibrationImpossibleError as fault:
            warnings.append(f"cross_spectrum: {fault}")
    claims = cross_spectrum.claims if cross_spectrum else examined(runs, vehicle, sister)
    if "ratio_index" in estimators:
        held = {one.drive for one in claims if one.state is ClaimState.HELD}
        known = [run for run in runs if run.is_known and run.name not in held]
        try:
            if not known:
                raise CalibrationImpossibleError("no run has a known payload and place")
            ratio_index = fit_ratio_index(known, vehicle, bands=bands, progress=partial(on_fit, "ratio_index"))
        except CalibrationImpossibleError as fault:
            warnings.append(f"ratio_index: {fault}")
    return ratio_index, cross_spectrum, claims, warnings


def with_statements_tested(inspection: Inspection, vehicle: Vehicle, like: CalibrationFile | None = None) -> Inspection:
    """The inspection with a warning for each run whose statement the drives contradict, as a calibration tests it."""
    sister = None if like is None else sister_in(like)
    runs = [one.identification for one in inspection.usable if one.has_identification]
    return _with_disagreements(inspection, examined(runs, vehicle, sister))


def _with_disagreements(inspection: Inspection, claims: Sequence[FoundClaim]) -> Inspection:
    """The inspection with a warning for each run whose statement was held: the drives contradict it beyond chance."""
    held = {one.drive: one for one in claims if one.state is ClaimState.HELD}
    runs = [
        replace(one, findings=(*one.findings, _disagreement(one.run, held[one.run.name])))
        if one.run.name in held
        else one
        for one in inspection.runs
    ]
    return replace(inspection, runs=tuple(runs))


def _disagreement(run: StatedDrive, claim: FoundClaim) -> Finding:
    shown = f"the drive shows {claim.without_kg:.0f} ± {Z95 * claim.without_std_kg:.0f} kg"
    shown += " at another place" if claim.is_of_place else ""
    text = f"the campaign says {run.described}, {shown}; the statement taught nothing"
    if claim.exchanged_with is None:
        return Finding.of(Kind.LOAD_DISAGREES, text)
    return Finding.of(Kind.LOADS_SWAPPED, f"{text}; exchanged with {claim.exchanged_with}, both fit far better")


def _as_believed(inspection: Inspection, claims: Sequence[FoundClaim], taught: Taught | None) -> Inspection:
    """The inspection with the loads as the fit believes them, without held statements and without common errors."""
    held = {one.drive for one in claims if one.state is ClaimState.HELD}

    def believed(run: StatedDrive) -> StatedDrive:
        found = taught.load_of(run.name) if taught else None
        if run.name in held and not (found and math.isfinite(found.stated_kg)):
            return replace(run, payload_kg=math.nan, front_share_pct=math.nan)
        if not run.statement.claims or not found:
            return run
        statement = replace(run.statement, payload_plus_minus_kg=Z95 * found.stated_std_kg)
        return replace(run, statement=statement, payload_kg=found.stated_kg)

    runs = [replace(one, identification=believed(one.identification)) for one in inspection.runs]
    return replace(inspection, runs=tuple(runs))


def _seen(runs: Sequence[StatedDrive], taught: Taught | None) -> SeenPart:
    """The ranges covered by the runs with a batch, and by those of its sister; unknown loads as the fit found them."""
    counted = [batch for run in runs for batch in run.batches if not batch.rejected]
    speeds_mps = [batch.mean_speed_mps for batch in counted]
    roughness = [roughness_mps2(spectra_of(batch), batch.mean_speed_mps) for batch in counted]
    loads: list[Load] = []
    if taught is not None:
        loads += taught.model.taught_loads[: -len(taught.loads)]
        speeds_mps += taught.model.speed_seen_mps
    for run in runs:
        if any(not batch.rejected for batch in run.batches):
            found = taught.load_of(run.name) if taught else None
            is_stated = run.is_known and not (found and found.is_held)
            loads.append(run.load if found is None or is_stated else found.load)
    return SeenPart(
        payload_kg=_span([load.payload_kg for load in loads]),
        front_share_pct=_span([load.front_share_pct for load in loads]),
        speed_mps=_span(speeds_mps),
        roughness_mps2=_span(roughness) if any(math.isfinite(one) for one in roughness) else None,
        sensor_rate_hz=sensor_rate_seen_hz(runs),
    )


def _span(numbers: Sequence[float]) -> tuple[float, float]:
    """The least and the largest of those that are known."""
    known = [one for one in numbers if math.isfinite(one)]
    return min(known), max(known)


def _expected_errors(ratio_index: RatioIndexFit | None, taught: Taught | None) -> dict[str, ExpectedErrorsPart]:
    errors: dict[str, tuple[F64 | None, F64 | None]] = {}
    if ratio_index is not None:
        errors["ratio_index"] = ratio_index.payload_errors_kg, ratio_index.front_share_errors_pct
    if taught is not None:
        rows = np.array([one.error[:2] for one in taught.errors]).reshape(-1, 2)
        errors["cross_spectrum"] = rows[:, 0], rows[:, 1]
    return {
        name: ExpectedErrorsPart(payload_rms_kg=_rms(payload_kg), front_share_rms_pct=_rms(share_pct))
        for name, (payload_kg, share_pct) in errors.items()
    }


def _rms(errors: F64 | None) -> float | None:
    known = np.empty(0) if errors is None else errors[np.isfinite(errors)]
    return float(np.sqrt(np.mean(known**2))) if known.size else None


def _provenance(
    campaign_sha256: str, runs: Sequence[InspectedRun], taught: Taught | None, command: str
) -> ProvenancePart:
    drives = []
    for one in runs:
        run, span_ns = one.identification, one.log.span_ns
        is_dated = span_ns is not None and span_ns[0] >= FIRST_DATED_NS
        found = taught.load_of(run.name) if taught else None
        drives.append(
            DrivePart(
                number=run.number,
                log=run.log,
                sha256=one.log.sha256,
                t_start=iso_utc(span_ns[0]) if span_ns and is_dated else None,
                t_end=iso_utc(span_ns[1]) if span_ns and is_dated else None,
                n_batches=sum(not batch.rejected for batch in run.batches),
                statement=run.statement,
                found=_found_part(found) if found else None,
            )
        )
    return ProvenancePart(
        software=f"springscale {version('springscale')}",
        command=command,
        campaign_sha256=campaign_sha256,
        drives=tuple(drives),
    )


def _found_part(found: FoundLoad) -> FoundPart:
    is_stated = math.isfinite(found.without_kg)
    return FoundPart(
        payload_kg=found.load.payload_kg,
        payload_std_kg=found.payload_std_kg,
        front_share_pct=found.load.front_share_pct,
        without_statement_kg=found.without_kg if is_stated else None,
        without_statement_std_kg=found.without_std_kg if is_stated else None,
        is_held=found.is_held,
    )
