"""The runs and their findings, the plan of further runs, and the provenance of every number."""

from gateway.calibration.calibrate import Outcome
from gateway.calibration.inspection.finding import Finding, RunVerdict
from gateway.calibration.inspection.log import SplitRun
from gateway.calibration.judgement.assessment import Assessment
from gateway.calibration.plan.plan import Expected, LoadPlan, OffCentreLoad
from gateway.calibration.plan.words import load_words
from gateway.estimate import Z95
from gateway.records import Why
from gateway.reports.charts import Section, Table
from gateway.words import NONE, decimal, percent, span


def runs_section(outcome: Outcome) -> Section:
    """Every run with its verdict; what was found of it, of all of them, and what to do."""
    driven = {one.identification.number: one for one in outcome.split}
    rows = tuple(_run_row(verdict, driven.get(verdict.number)) for verdict in outcome.inspection.verdicts)
    columns = ("Run", "log", "verdict", "payload", "front share", "identify", "validate", "refused")
    caption = "Runs: batches that identify, that validate, and that no estimator can use"
    findings = _findings_table(outcome)
    return Section("runs", "Runs", (), (), (Table(caption, columns, rows), *((findings,) if findings else ())))


def _run_row(verdict: RunVerdict, driven: SplitRun | None) -> tuple[str, ...]:
    if driven is None:
        return (str(verdict.number), verdict.name, _verdict(verdict), *(NONE,) * 5)
    run, batches = driven.identification, [*driven.identification.batches, *driven.validation.batches]
    refused = [b for b in batches if b.rejected and Why.TOO_SHORT not in b.rejected]  # a run's last piece is no batch
    return (
        str(run.number),
        run.name,
        _verdict(verdict),
        f"{run.payload_kg:g} kg",
        f"{run.front_share_pct:.1f} %",
        *(str(sum(not batch.rejected for batch in part.batches)) for part in (run, driven.validation)),
        str(len(refused)),
    )


def _verdict(verdict: RunVerdict) -> str:
    if not verdict.findings:
        return "sound"
    judged = "usable" if verdict.is_usable else "cannot be used"
    return f"{judged}: {', '.join(_spoken(finding) for finding in verdict.findings)}"


def _spoken(finding: Finding) -> str:
    return finding.kind.replace("_", " ")


def _findings_table(outcome: Outcome) -> Table | None:
    findings = [("all", finding) for finding in outcome.inspection.findings]
    for verdict in outcome.inspection.verdicts:
        findings += [(str(verdict.number), finding) for finding in verdict.findings]
    rows = tuple((run, str(one.severity), _spoken(one), one.text, one.advice) for run, one in findings)
    columns = ("Run", "weight", "what", "as found", "what to do")
    return Table("What was found of the runs", columns, rows) if rows else None


def plan_section(plan: LoadPlan) -> Section:
    """The runs that would teach most, in order."""
    minutes, kmh = plan.drive.duration_s / 60.0, 3.6 * plan.drive.speed_mps
    rows = [("now", *_expected(plan.now))] if plan.now else []
    rows += [
        (f"{number}. {load_words(step.load)}", *_expected(step.expected)) for number, step in enumerate(plan.advice, 1)
    ]
    rows += [(f"least useful: {load_words(plan.least.load)}", *_expected(plan.least.expected))] if plan.least else []
    columns = ("After driving", "payload", "front share", "loads within reach")
    caption = f"Expected of a five-minute batch, ± spans 95 %; each run {minutes:.0f} minutes near {kmh:.0f} km/h"
    text = (
        "The runs after which loads would be weighed best, each with those above it. These are the half-car's own "
        "predictions, to first order: they show which run to drive rather than how good the result will be."
    )
    paragraphs = (text, *([_sideways(plan.sideways)] if plan.sideways else []))
    return Section("next", "What to drive next", paragraphs, (), (Table(caption, columns, tuple(rows)),))


def _sideways(sideways: OffCentreLoad) -> str:
    load, left_m = sideways.load, sideways.payload_left_m
    return (
        f"One run with a load to one side, such as {load.payload_kg:g} kg {left_m:g} m left of the centre line "
        f"(payload_left_m = {left_m:g}), would show what such a load does, which so far follows from springs and road "
        "alone, and the signs of the roll rate and of sensor_offset_left_m."
    )


def _expected(expected: Expected) -> tuple[str, str, str]:
    reach = percent(expected.reach_share)
    payload_kg, share_pct = Z95 * expected.payload_std_kg, Z95 * expected.front_share_std_pct
    return f"± {payload_kg:.1f} kg", f"± {share_pct:.2f} pp", reach


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
        ("campaign file", f"sha256:{provenance.campaign_sha256}"),
    )
    runs = tuple(
        (str(run.number), run.log, f"{run.payload_kg:g} kg", decimal(run.front_share_pct, " %", 1), run.sha256)
        for run in provenance.runs
    )
    logs = Table("Logs it was made from", ("Run", "log", "payload", "front share", "sha256"), runs)
    return Section("provenance", "Provenance", (), (), (Table("Calibration", ("What", "is"), facts), logs))
