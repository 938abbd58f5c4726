"""The texts of `springscale calibrate`: what inspection found, and which load to drive next."""

from collections.abc import Iterable, Iterator, Sequence

from gateway.calibration.inspection import Finding, Inspection, RunVerdict, SplitRun
from gateway.calibration.plan import Expected, LoadPlan, PlacedLoad, StatedWidths
from gateway.estimate import Z95


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


def plan_sentences(plan: LoadPlan) -> str:
    """The present expectation, the runs to drive in order, and the gain of each."""
    is_enough = plan.is_enough_driven
    what = "most would bring" if is_enough else "drive next"
    minutes, kmh = plan.drive.duration_s / 60.0, 3.6 * plan.drive.speed_mps
    lines = [
        _now(plan),
        *(["enough is driven: no further run would narrow answers by a tenth"] if is_enough else []),
        f"{what}, each for {minutes:.0f} minutes near {kmh:.0f} km/h:",
        *(f"{i}. {_load(step.load)}: then {_expected(step.expected)}" for i, step in enumerate(plan.advice, 1)),
    ]
    if plan.least is not None:
        lines.append(f"least useful would be: {_load(plan.least.load)}: then {_expected(plan.least.expected)}")
    if plan.sideways is not None:
        load, left_m = plan.sideways.load, plan.sideways.payload_left_m
        lines.append(
            f"one run with a load to one side: {_load(load)}, {left_m:g} m left or right of the centre line "
            f"(payload_left_m = {left_m:g} or -{left_m:g}): what such a load does then shows, and no longer follows "
            "from springs and road alone; so do the signs of the roll rate and of sensor_offset_left_m"
        )
    return "\n".join(lines)


def widths_sentence(widths: StatedWidths) -> str:
    """The cost of not stating what the vehicle carries."""
    kinds = ", ".join(
        f"{one.unsaid.payload_kg:.0f} ± {one.unsaid.half_width_kg:.0f} kg with {kind} "
        f"({one.said.payload_kg:.0f} ± {one.said.half_width_kg:.0f} once said)"
        for kind, one in widths.carries.items()
    )
    return (
        f"The campaign does not say what the vehicle carries. One batch would state a load of {widths.payload_kg:g} "
        f"kg as {kinds}; "
        "± values are 95 % intervals. State it in [vehicle]: carries, or payload_length_m and payload_height_m."
    )


def _now(plan: LoadPlan) -> str:
    if plan.now is None:
        return f"{plan.vehicle}: nothing driven yet; expected from typical road vehicles"
    return f"{plan.vehicle}, {plan.n_driven} runs driven: expected {_expected(plan.now)}"


def _load(load: PlacedLoad) -> str:
    if load.position_m is None:
        return "the empty vehicle"
    return f"load {load.payload_kg:g} kg with its centre {load.position_m:g} m behind the front axle"


def _expected(expected: Expected) -> str:
    payload_kg, share_pct = Z95 * expected.payload_std_kg, Z95 * expected.front_share_std_pct
    text = f"± {payload_kg:.0f} kg and ± {share_pct:.1f} percentage points (95 %)"
    if expected.reach_share is None:
        return text
    return f"{text}, {100.0 * expected.reach_share:.0f} % of the loads it may carry within reach"
