"""The third gyro axis on recorded drives: calibrated with a roll rate, what is promised of loads that lie sideways, and
of sister vehicles that inherit this calibration.

The bounds are promises to users, not fits: they may only ever be tightened.
"""

import json
from pathlib import Path
from statistics import fmean
from typing import Any

import pytest
from support.commands import printed
from support.recordings import calibrated_with_roll_rate, recordings

CROSS = ("--estimator", "cross_spectrum")
QUANTITIES = ("payload", "front_share", "cg_left")
VANS = ("van_1", "van_2")


@pytest.fixture(scope="module")
def calibration() -> Path:
    return calibrated_with_roll_rate()


def missed(found: str) -> pytest.MarkDecorator:
    """A bound that is wanted and not reached: with nothing said of a load, compact and long ones weigh differently."""
    return pytest.mark.xfail(strict=True, reason=found)


@pytest.mark.parametrize(
    ("drives", "arguments", "n_batches", "payload_pct", "front_share_pct", "cg_left_m"),
    [
        pytest.param("known_loads", [], 10, 1.2, 0.6, None, marks=missed("payload 1.8 %")),
        pytest.param("known_loads", ["--window-s", "60"], 50, 2.0, 1.2, None, marks=missed("payload 2.6 %")),
        pytest.param("speeds", [], 15, 2.4, 1.0, None, marks=missed("front share 1.06 %")),
        pytest.param("sideways", [], 10, 1.3, 0.7, 0.006, marks=missed("front share 0.72 %")),
        ("mixed", [], 24, 2.5, 1.2, 0.006),
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
        printed("evaluate", campaign, "--calibration", calibration, "--json", *CROSS, *arguments)
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
    found: dict[str, Any] = json.loads(printed("evaluate", campaign, "--calibration", calibration, "--json", *CROSS))
    assert found["n_batches"] == n_batches
    assert found["n_rejected"] <= most_refused
    assert found["payload"]["coverage95"] >= 0.9
    assert found["front_share"]["coverage95"] >= 0.9


def test_two_empty_drives_calibrate_a_sister(calibration: Path, tmp_path: Path) -> None:
    """On mixed drives with other loads, where priors of any vehicle refuse every batch at another speed."""
    _require_true([_sister(calibration, tmp_path / "van.json", name) for name in VANS], 3.0, 1.4)


def _require_true(judged: list[dict[str, Any]], payload_pct: float, front_share_pct: float) -> None:
    """Mean errors of both vans, no batch refused, intervals of each that hold."""
    assert [one["n_batches"] for one in judged] == [18, 18]
    assert [one["n_rejected"] for one in judged] == [0, 0]
    assert fmean(one["payload"]["mean_abs_pct"] for one in judged) <= payload_pct
    assert fmean(one["front_share"]["mean_abs_pct"] for one in judged) <= front_share_pct
    assert min(one[quantity]["coverage95"] for one in judged for quantity in ("payload", "front_share")) >= 0.93


def _sister(calibration: Path, output: Path, name: str) -> dict[str, Any]:
    drives = recordings() / "siblings" / name
    like = ("--like", calibration, "--output", output, "--json", *CROSS)
    printed("calibrate", drives / "empty" / "campaign_roll.toml", *like)
    return _evaluated(output, name)


def _evaluated(calibration: Path, name: str) -> dict[str, Any]:
    """The errors of the calibration on the vehicle's drives with loads."""
    tests = recordings() / "siblings" / name / "test" / "campaign_roll.toml"
    return json.loads(printed("evaluate", tests, "--calibration", calibration, "--json", *CROSS))
