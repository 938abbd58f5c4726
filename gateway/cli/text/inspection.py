"""Verdicts on known-load drives, for people and for programs."""

from collections.abc import Iterable, Iterator, Sequence

from gateway.calibration.inspection import Finding, Inspection, RunVerdict, SplitRun


def inspection_sentences(inspection: Inspection) -> str:
    """A line a run, its findings below with what to do about each; then those of all runs together, and the usable
    runs.
    """
    lines: list[str] = []
    for one, verdict in zip(inspection.split, inspection.verdicts, strict=True):
        lines += [_run_line(one, verdict), *_finding_lines(verdict.findings)]
    if inspection.findings:
        lines += ["all runs together", *_finding_lines(inspection.findings)]
    return "\n".join([*lines, _in_all(inspection)])


def _in_all(inspection: Inspection) -> str:
    """How many runs are usable, and the loads they cover."""
    runs = [one.identification for one in inspection.usable if one.has_identification]
    counted = f"{len(inspection.usable)} of {len(inspection.split)} runs can be used"
    if not runs:
        return counted
    payloads_kg, shares_pct = [run.payload_kg for run in runs], [run.front_share_pct for run in runs]
    loads, shares = _from_to(payloads_kg, "g"), _from_to(shares_pct, ".1f")
    return f"{counted}: {loads} kg, {shares} % in front"


def _from_to(numbers: Sequence[float], form: str) -> str:
    """Least and greatest; one number if they print alike."""
    least, greatest = format(min(numbers), form), format(max(numbers), form)
    return least if least == greatest else f"{least} to {greatest}"


def _run_line(one: SplitRun, verdict: RunVerdict) -> str:
    batches = [batch for part in (one.identification, one.validation) for batch in part.batches if not batch.rejected]
    n_identifying = sum(not batch.rejected for batch in one.identification.batches)
    seconds = sum(batch.usable_share * batch.duration_s for batch in batches)
    n_validating = len(batches) - n_identifying
    driven = f"{n_identifying} batches for fitting, {n_validating} for validation, {seconds:.0f} s can be used"
    words = "left out" if not verdict.is_usable else "sound" if not verdict.findings else "usable"
    load = f"{one.identification.payload_kg:g} kg"
    return f"run {verdict.number} {verdict.name} ({load}): {words}; {driven}"


def _finding_lines(findings: Iterable[Finding]) -> Iterator[str]:
    for finding in findings:
        yield f"    {finding.severity} {finding.kind}: {finding.text}"
        yield f"        {finding.advice}"


def inspection_json(inspection: Inspection) -> dict[str, object]:
    """A verdict a run, findings about all runs together, and why there is no calibration (null if there is one)."""
    return {
        "refusal": inspection.refusal,
        "runs": [
            {
                "number": verdict.number,
                "log": verdict.name,
                "is_usable": verdict.is_usable,
                "findings": [finding.to_json() for finding in verdict.findings],
            }
            for verdict in inspection.verdicts
        ],
        "campaign_findings": [finding.to_json() for finding in inspection.findings],
    }
