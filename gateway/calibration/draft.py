"""A campaign file before its first drive: [vehicle] alone is enough to plan from."""

from pathlib import Path

from gateway.calibration.campaign import Campaign, CampaignTable, RunTable, load_campaign
from gateway.errors import CampaignError
from gateway.toml_file import load_toml


class DraftTable(CampaignTable):
    """A campaign file in which signals and runs may still be missing."""

    signals: str = ""
    runs: tuple[RunTable, ...] = ()


def load_draft(path: Path) -> Campaign:
    """A campaign, complete or still without runs. Raises CampaignError as load_campaign does."""
    draft = load_toml(path, DraftTable, CampaignError)
    return load_campaign(path) if draft.runs else Campaign(path, draft)
