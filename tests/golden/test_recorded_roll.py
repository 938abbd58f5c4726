"""The third gyro axis on recorded drives: calibrated with a roll rate, what is promised of loads that lie sideways, and
of sister vehicles that inherit this calibration.

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
QUANTITIES = ("payload", "front_share", "cg_left")


def run(*arguments: str | Path) -> str:
    found = CliRunner().invoke(springscale, [str(argument) for argument in arguments], catch_exceptions=False)
    assert found.exit_code == 0, found.output
    return found.stdout


@pytest.fixture(scope="module")
def calibration(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """On the identification parts of all ten known loads, none of which lies sideways."""
    output = tmp_path_factory.mktemp("vehicle") / "vehicle.json"
    run("calibrate", recordings() / "known_loads/campaign_roll.toml", "--output", output, "--json", *CROSS)
    return output


@pytest.mark.parametrize(
    ("drives", "arguments", "n_batches", "payload_pct", "front_share_pct", "cg_left_m"),
    [
        ("known_loads", [], 10, 1.4, 0.6, None),
        ("known_loads", ["--window-s", "60"], 50, 2.0, 1.2, None),
        ("speeds", [], 15, 3.6, 1.3, None),
        ("sideways", [], 10, 2.0, 0.8, 0.006),
        ("mixed", [], 24, 3.6, 1.3, 0.007),
    ],
    ids=["known loads", "known loads by the minute", "speeds", "sideways", "mixed"],
)
def test_errors_stay_small_and_intervals_true(
    calibration: Path,
    drives: str,
    arguments: list[str],
    n_batches: int,
    payload_pct: float,
    front_share_pct: float,
    cg_left_m: float | None,
) -> None:
    campaign = recordings() / drives / "campaign_roll.toml"
    found: dict[str, Any] = json.loads(
        run("evaluate", campaign, "--calibration", calibration, "--json", *CROSS, *arguments)
    )
    assert found["n_batches"] == n_batches
    assert found["n_rejected"] <= 0.1 * n_batches
    assert found["payload"]["mean_abs_pct"] <= payload_pct
    assert found["front_share"]["mean_abs_pct"] <= front_share_pct
    assert {
        quantity: found[quantity]["coverage95"] for quantity in QUANTITIES if found[quantity]["coverage95"] < 0.9
    } == {}
    if cg_left_m is not None:
        assert found["cg_left"]["mean_abs_m"] <= cg_left_m


@pytest.mark.parametrize(
    ("drives", "n_batches", "most_refused"), [("known_loads", 10, 1), ("sideways", 10, 1), ("mixed", 24, 6)]
)
def test_a_lost_roll_rate_leaves_true_intervals(
    calibration: Path, drives: str, n_batches: int, most_refused: int
) -> None:
    """By the map without it: the sensor sits 0.3 m off the centre line, and reads roll whether it is told or not."""
    campaign = recordings() / drives / "campaign.toml"
    found: dict[str, Any] = json.loads(run("evaluate", campaign, "--calibration", calibration, "--json", *CROSS))
    assert found["n_batches"] == n_batches
    assert found["n_rejected"] <= most_refused
    assert found["payload"]["coverage95"] >= 0.9
    assert found["front_share"]["coverage95"] >= 0.9


@pytest.mark.parametrize(
    ("arguments", "payload_pct", "front_share_pct"), [(["--runs", "1"], 3.5, 1.5), ([], 3.0, 1.4)], ids=["one", "two"]
)
def test_empty_drives_calibrate_a_sister(
    calibration: Path, tmp_path: Path, arguments: list[str], payload_pct: float, front_share_pct: float
) -> None:
    """On mixed drives with other loads, where priors of any vehicle refuse every batch at another speed."""
    judged = [_sister(calibration, tmp_path / "van.json", name, arguments) for name in ("van_1", "van_2")]
    assert [one["n_batches"] for one in judged] == [18, 18]
    assert [one["n_rejected"] for one in judged] == [0, 0]
    assert fmean(one["payload"]["mean_abs_pct"] for one in judged) <= payload_pct
    assert fmean(one["front_share"]["mean_abs_pct"] for one in judged) <= front_share_pct
    assert min(one[quantity]["coverage95"] for one in judged for quantity in ("payload", "front_share")) >= 0.93


def _sister(calibration: Path, output: Path, name: str, arguments: list[str]) -> dict[str, Any]:
    drives = recordings() / "siblings" / name
    like = ("--like", calibration, "--output", output, "--json", *CROSS)
    run("calibrate", drives / "empty" / "campaign_roll.toml", *like, *arguments)
    judged = run("evaluate", drives / "test" / "campaign_roll.toml", "--calibration", output, "--json", *CROSS)
    found: dict[str, Any] = json.loads(judged)
    return found
