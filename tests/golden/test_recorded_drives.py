"""The whole path on recorded drives: campaign -> calibration -> error table, with the bounds the project promises.

The bounds are promises to users, not fits: they may only ever be tightened.
"""

import json
import tomllib
from functools import cache
from pathlib import Path
from statistics import fmean, stdev
from typing import Any

import pytest
from support.commands import printed
from support.recordings import recordings

CROSS = ("--estimator", "cross_spectrum")


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The file calibrated on the identification parts of all ten known loads, and what was told meanwhile."""
    output = tmp_path_factory.mktemp("vehicle") / "vehicle.json"
    told = printed("calibrate", recordings() / "known_loads/campaign.toml", "--output", output, "--json")
    return output, json.loads(told)


@pytest.fixture(scope="module")
def calibration(calibrated: tuple[Path, dict[str, Any]]) -> Path:
    return calibrated[0]


def test_ten_sound_runs_are_sound(calibrated: tuple[Path, dict[str, Any]]) -> None:
    inspection = calibrated[1]["inspection"]
    assert [one["findings"] for one in inspection["runs"]] == [[]] * 10


@cache
def table(campaign: str, calibration: Path, *arguments: str) -> dict[str, Any]:
    text = printed("evaluate", recordings() / campaign, "--calibration", calibration, "--json", *arguments)
    return json.loads(text)


@pytest.mark.parametrize(
    ("campaign", "arguments", "n_batches", "payload_pct", "front_share_pct"),
    [
        ("known_loads/campaign.toml", [*CROSS], 10, 3.0, 1.5),
        ("speeds/campaign.toml", [*CROSS], 15, 5.0, 2.0),
        ("known_loads/campaign.toml", [*CROSS, "--window-s", "60"], 50, 6.0, 2.0),
        ("known_loads/campaign.toml", ["--estimator", "ratio_index"], 10, 15.0, 8.0),
    ],
)
def test_errors_stay_within_what_is_promised(
    calibration: Path, campaign: str, arguments: list[str], n_batches: int, payload_pct: float, front_share_pct: float
) -> None:
    found = table(campaign, calibration, *arguments)
    assert found["n_batches"] == pytest.approx(n_batches, abs=0)
    assert found["n_rejected"] <= 0.1 * n_batches
    assert found["payload"]["mean_abs_pct_with_misses"] <= payload_pct
    assert found["front_share"]["mean_abs_pct_with_misses"] <= front_share_pct


@pytest.mark.parametrize(
    ("drives", "n_batches", "arguments"),
    [
        ("known_loads", 10, []),
        ("known_loads", 50, ["--window-s", "60"]),
        ("speeds", 15, []),
        ("sideways", 10, []),
        ("mixed", 24, []),
    ],
)
def test_without_a_roll_rate_payload_intervals_still_hold(
    calibration: Path, drives: str, n_batches: int, arguments: list[str]
) -> None:
    """Where loads lie sideways too, which nothing tells: a tenth of the answers may be missed, and of the batches."""
    found = table(f"{drives}/campaign.toml", calibration, *CROSS, *arguments)
    assert found["n_batches"] == n_batches
    assert found["n_rejected"] <= 0.1 * n_batches
    assert found["payload"]["coverage95"] >= 0.9
    assert found["cg_left"] is None or found["cg_left"]["mean_abs_m"] is None


def test_three_known_loads_are_enough(tmp_path: Path) -> None:
    output = tmp_path / "three.json"
    printed("calibrate", recordings() / "known_loads/campaign.toml", "--output", output, "--runs", "1,6,10", *CROSS)
    found = table("known_loads/campaign.toml", output, *CROSS)
    assert found["payload"]["mean_abs_pct"] <= 6.0
    assert found["front_share"]["mean_abs_pct"] <= 3.0


@pytest.mark.parametrize("trip", ["A", "B"])
def test_a_real_drive_gives_an_answer_or_reasons_per_batch(trip: str) -> None:
    folder = recordings() / "real_drive"
    text = printed("estimate", folder / f"candump_trip{trip}.log.gz", "--signals", folder / "signals.toml", "--json")
    records = [json.loads(line) for line in text.splitlines()]
    whole = [record for record in records if "too_short" not in record["rejected"]]
    assert len(whole) >= 6
    assert all("no_calibration" in record["rejected"] and record["payload_kg"] is None for record in records)
    driven = [record for record in whole if record["rejected"] == ["no_calibration"]]
    assert all(5.0 < record["mean_speed_mps"] < 40.0 and record["spectra"] for record in driven)


def real_campaign(folder: Path, trip: str, payload_kg: float) -> Path:
    """One trip of the real car, declared to carry so much amidships."""
    drives = recordings() / "real_drive"
    content = tomllib.loads((drives / f"campaign_trip_{trip}.toml").read_text(encoding="utf-8"))
    vehicle = content["vehicle"]
    lines = ["[vehicle]", *(f"{name} = {json.dumps(stated)}" for name, stated in vehicle.items())]
    lines += ["[[runs]]", f'log = "{drives}/candump_trip{trip.upper()}.log.gz"', f"payload_kg = {payload_kg}"]
    if payload_kg:
        lines.append(f"payload_position_m = {vehicle['wheelbase_m'] / 2.0}")
    campaign = folder / f"{trip}_{payload_kg:.0f}.toml"
    head = [f'signals = "{drives}/signals.toml"', "identification_fraction = 1.0"]
    campaign.write_text("\n".join(head + lines), encoding="utf-8")
    return campaign


@pytest.mark.xfail(
    strict=True,
    reason="one drive without a roll rate leaves springs and dampers so open that batches of one load scatter by 45 to "
    "53 kg, and their mean is 33 kg off; the intervals hold it",
)
@pytest.mark.parametrize(("known", "weighed"), [("a", "b"), ("b", "a")])
def test_two_trips_of_a_real_car_weigh_alike_and_a_declared_load_moves_them(
    tmp_path: Path, known: str, weighed: str
) -> None:
    found = {}
    for declared_kg in (0.0, 100.0):
        output = tmp_path / f"{declared_kg:.0f}.json"
        printed("calibrate", real_campaign(tmp_path, known, declared_kg), "--output", output, *CROSS)
        assert json.loads(output.read_text(encoding="utf-8"))["cross_spectrum"]["warnings"][0] == "springs_from_priors"
        campaign = real_campaign(tmp_path, weighed, 0.0)
        told = json.loads(printed("evaluate", campaign, "--calibration", output, "--split", "all", "--json"))
        found[declared_kg] = [b["payload_kg"] for b in told["batches"] if b["payload_kg"] is not None]
    assert len(found[0.0]) >= 6
    assert abs(fmean(found[0.0])) <= 25.0
    assert stdev(found[0.0]) <= 20.0
    assert fmean(found[100.0]) - fmean(found[0.0]) == pytest.approx(100.0, abs=25.0)


def test_the_calibration_predicts_its_errors(calibration: Path) -> None:
    """Errors on runs left out of the fit, of both estimators, and the roads they were made over."""
    shown = json.loads(calibration.read_text(encoding="utf-8"))
    assert set(shown["expected_errors"]) == {"cross_spectrum", "ratio_index"}
    for errors in shown["expected_errors"].values():
        assert 0.0 < errors["payload_rms_kg"] < 100.0
        assert 0.0 < errors["front_share_rms_pct"] < 5.0
    smooth, rough = shown["seen"]["roughness_mps2"]
    assert 0.0 < smooth < rough
