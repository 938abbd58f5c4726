"""Whether a calibration file is intact, and whether the logs it was made from are unchanged."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from gateway.calibration.campaign import Campaign, file_sha256
from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.calibration.file.parts import RunPart


class CheckResult(StrEnum):
    """The result of a check. A note does not affect the numbers."""

    GOOD = "good"
    NOTE = "note"
    FAULT = "fault"


@dataclass(frozen=True, slots=True)
class Check:
    """One checked item."""

    what: str
    verdict: CheckResult
    text: str


def check_against_campaign(file: CalibrationFile, campaign: Campaign) -> tuple[Check, ...]:
    """Logs, loads and campaign file compared with the calibration's record of them."""
    return (_campaign_file(file, campaign), *(_run(run, campaign) for run in file.provenance.runs))


def _campaign_file(file: CalibrationFile, campaign: Campaign) -> Check:
    if file_sha256(campaign.path) == file.provenance.campaign_sha256:
        return Check("campaign", CheckResult.GOOD, f"{campaign.path} is the one it was made from")
    return Check(
        "campaign", CheckResult.NOTE, f"{campaign.path} was changed since, or is another: its runs are checked"
    )


def _run(run: RunPart, campaign: Campaign) -> Check:
    what = f"run {run.number}"
    if run.number > len(campaign.runs):
        return Check(what, CheckResult.FAULT, f"{run.log}: the campaign has {len(campaign.runs)} runs only")
    stated = campaign.runs[run.number - 1]
    log = campaign.log_of(stated)
    sha256 = _hash_of(log)
    if sha256 is None:
        return Check(what, CheckResult.FAULT, f"{log}: cannot be read")
    if sha256 != run.sha256:
        return Check(what, CheckResult.FAULT, f"{log}: not the log it was calibrated from (sha256 {sha256[:12]}...)")
    if stated.payload_kg != run.payload_kg or campaign.front_share_pct(stated) != run.front_share_pct:
        return Check(
            what,
            CheckResult.FAULT,
            f"{log}: calibrated as {run.payload_kg:g} kg and {run.front_share_pct:.4g} %, the campaign says "
            f"{stated.payload_kg:g} kg and {campaign.front_share_pct(stated):.4g} %",
        )
    return Check(what, CheckResult.GOOD, f"{log}")


def _hash_of(log: Path) -> str | None:
    try:
        return file_sha256(log)
    except OSError:
        return None
