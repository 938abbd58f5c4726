"""Recorded drives on a machine that has them, and the calibration that several tests weigh them by."""

import os
from pathlib import Path

import pytest

from support.commands import run
from support.kept import kept_file

FOLDER = Path(os.environ.get("SPRINGSCALE_DATA", Path(__file__).parents[3] / "shared" / "data"))


def recordings() -> Path:
    """The folder; skips the test where it is absent."""
    if not FOLDER.is_dir():
        pytest.skip(f"the recorded drives are not at {FOLDER} (set SPRINGSCALE_DATA)")
    return FOLDER


def calibrated_with_roll_rate() -> Path:
    """The cross spectrum on the identification parts of all ten known loads, none of which lies sideways."""
    campaign = recordings() / "known_loads/campaign_roll.toml"

    def calibrate(output: Path) -> None:
        run("calibrate", campaign, "--output", output, "--estimator", "cross_spectrum")

    return kept_file("calibrated_with_roll_rate.json", calibrate)
