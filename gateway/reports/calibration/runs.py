"""The runs and their findings, and the provenance of every number."""

from gateway.calibration.file import DrivePart
from gateway.calibration.from_drives import Outcome
from gateway.calibration.inspection.facts import InspectedRun
from gateway.calibration.inspection.finding import Finding
from gateway.calibration.judgement.assessment import Assessment
from gateway.estimates.quantity import Z95
from gateway.records import Why
from gateway.reports.charts import Section, Table
from gateway.words import NONE, known, span


def runs_section(outcome: Outcome) -> Section:
    """Every run with its verdict; what was found of it, of all of them, and what to do."""
    rows = tuple(_run_row(one) for one in outcome.inspection.runs)
    columns = ("Run", "log", "verdict", "payload", "front share", "identify", "validate", "refused")
    caption = "Runs: batches that identify, that validate, and that no estimator can use"
    findings = _findings_table(outcome)
    return Section("runs", "Runs", (), (), (Table(caption, columns, rows), *((findings,) if findings else ())))


def _run_row(one: InspectedRun) -> tuple[str, ...]:
    run, batches = one.identification, [*one.identification.batches, *one.validating]
    named = (str(run.number), run.log, _verdict(one))
    if not one.is_usable:
        return (*named, *(NONE,) * 5)
    refused = [b for b in batches if b.rejected and Why.TOO_SHORT not in b.rejected]  # a run's last piece is no batch
    return (
        *named,
        known(run.statement.payload_kg, " kg"),
        known(run.statement.front_share_pct, " %", ".1f"),
        *(str(sum(not batch.rejected for batch in part)) for part in (run.batches, one.validating)),
        str(len(refused)),
    )


def _verdict(one: InspectedRun) -> str:
    if not one.findings:
        return "sound"
    judged = "usable" if one.is_usable else "cannot be used"
    return f"{judged}: {', '.join(_spoken(finding) for finding in one.findings)}"


def _spoken(finding: Finding) -> str:
    return finding.kind.replace("_", " ")


def _findings_table(outcome: Outcome) -> Table | None:
    findings = [("all", finding) for finding in outcome.inspection.findings]
    for one in outcome.inspection.runs:
        findings += [(str(one.run.number), finding) for finding in one.findings]
    rows = tuple((run, str(one.severity), _spoken(one), one.text, one.advice) for run, one in findings)
    columns = ("Run", "weight", "what", "as found", "what to do")
    return Table("What was found of the runs", columns, rows) if rows else None


def _stated_and_found(drive: DrivePart) -> tuple[str, str, str]:
    """Payload and front share as stated, and the payload that the fit found with and without the statement."""
    said, found = drive.statement, drive.found
    told = NONE
    if found is not None:
        told = f"{found.payload_kg:.0f} ± {Z95 * found.payload_std_kg:.0f} kg"
        if found.is_held:
            told += ", the statement is not believed"
    return known(said.payload_kg, " kg"), known(said.front_share_pct, " %", ".1f"), told


def provenance_section(assessment: Assessment) -> Section:
    """The facts for reproducing the calibration, and its valid ranges."""
    file, provenance = assessment.file, assessment.file.provenance
    seen = file.seen
    roughness = "not known" if seen.roughness_mps2 is None else span(*seen.roughness_mps2, "m/s²", 2)
    facts = (
        ("calibration", file.id),
        ("vehicle", file.vehicle.name),
        ("estimators", ", ".join(file.estimators)),
        ("payloads seen", span(*seen.payload_kg, "kg")),
        ("front shares seen", span(*seen.front_share_pct, "%", 1)),
        ("speeds seen", span(3.6 * seen.speed_mps[0], 3.6 * seen.speed_mps[1], "km/h")),
        ("roughness seen", roughness),
        *((("prior from", file.sister_id),) if file.sister_id else ()),
        ("software", provenance.software),
        ("command", provenance.command),
        ("file of the vehicle", f"sha256:{provenance.campaign_sha256}"),
    )
    drives = tuple((str(one.number), one.log, *_stated_and_found(one), one.sha256) for one in provenance.drives)
    columns = ("Run", "log", "payload", "front share", "found", "sha256")
    logs = Table("Logs it was made from", columns, drives)
    return Section("provenance", "Provenance", (), (), (Table("Calibration", ("What", "is"), facts), logs))
