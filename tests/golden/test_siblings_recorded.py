"""Vans calibrated by what a sister's known loads tell and one or two empty drives, on recorded mixed driving.

The bounds are promises to users, not fits: they may only ever be tightened.
"""

import json
from pathlib import Path
from statistics import fmean
from typing import Any

import pytest
from click.testing import CliRunner
from support.recordings import recordings

from gateway.cli import springscale

CROSS = ("--estimator", "cross_spectrum")
VANS = ("van_1", "van_2")


def run(*arguments: str | Path) -> str:
    found = CliRunner().invoke(springscale, [str(argument) for argument in arguments], catch_exceptions=False)
    assert found.exit_code == 0, found.output
    return found.stdout


@pytest.fixture(scope="module")
def line(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sister: all ten known loads."""
    output = tmp_path_factory.mktemp("line") / "line.json"
    run("calibrate", recordings() / "known_loads/campaign_roll.toml", "--output", output, "--json", *CROSS)
    return output


@pytest.mark.parametrize(
    ("runs", "payload_pct", "front_share_pct"), [(("--runs", "1"), 3.5, 1.5), ((), 3.0, 1.4)], ids=["one", "two"]
)
def test_empty_drives_are_enough(
    line: Path, tmp_path: Path, runs: tuple[str, ...], payload_pct: float, front_share_pct: float
) -> None:
    judged = [_judged(line, tmp_path / f"{van}.json", van, runs) for van in VANS]
    assert [one["n_rejected"] for one in judged] == [0, 0]
    for quantity, bound in (("payload", payload_pct), ("front_share", front_share_pct)):
        assert fmean(one[quantity]["mean_abs_pct"] for one in judged) <= bound
        assert fmean(one[quantity]["coverage95"] for one in judged) >= 0.93


def _judged(line: Path, output: Path, van: str, runs: tuple[str, ...]) -> dict[str, Any]:
    folder = recordings() / "siblings" / van
    run("calibrate", folder / "empty/campaign_roll.toml", "--like", line, "--output", output, "--json", *runs)
    found: dict[str, Any] = json.loads(
        run("evaluate", folder / "test/campaign_roll.toml", "--calibration", output, "--json")
    )
    return found
