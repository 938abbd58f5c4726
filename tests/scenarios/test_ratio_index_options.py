"""springscale calibrate --bands and --structure: what is named is what the calibration file then holds."""

from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from support.known_load_logs import write_known_loads

from gateway.calibration.file.calibration_file import CalibrationFile, load_calibration
from gateway.cli import springscale
from gateway.core.ratio_index.index import PAPER_BANDS
from gateway.core.ratio_index.regression import MODEL_9_PAYLOAD, MODEL_10_FRONT_SHARE


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four short drives, all of them to identify."""
    return write_known_loads(tmp_path_factory.mktemp("options"), duration_s=110.0, identification_fraction=1.0)


def calibrate(campaign: Path, output: Path, *options: str) -> Result:
    asked = ["calibrate", str(campaign), "--output", str(output), "--window-s", "100", "--estimator", "ratio_index"]
    return CliRunner().invoke(springscale, [*asked, *options])


def bands_of(held: CalibrationFile) -> list[tuple[float, float]]:
    pairs = (held.ratio_index.acceleration_bands, held.ratio_index.pitch_rate_bands)
    return [band for pair in pairs if pair is not None for band in pair]


def test_the_papers_bands_and_structure_are_taken_as_named(campaign: Path, tmp_path: Path) -> None:
    paper = [(band.centre_hz, band.width_hz) for pair in PAPER_BANDS.values() for band in pair]
    done = calibrate(campaign, tmp_path / "paper.json", "--bands", "table2", "--structure", "single")
    assert done.exit_code == 0, done.output
    held = load_calibration(tmp_path / "paper.json")
    assert bands_of(held) == paper
    assert held.ratio_index.payload.terms == MODEL_9_PAYLOAD
    assert held.ratio_index.front_share.terms == MODEL_10_FRONT_SHARE
    assert calibrate(campaign, tmp_path / "own.json", "--structure", "log").exit_code == 0
    own = load_calibration(tmp_path / "own.json")
    assert bands_of(own) != paper
    assert own.ratio_index.payload.terms == ("log_ra", "log_rg")


def test_a_structure_that_so_few_runs_cannot_carry_is_refused(campaign: Path, tmp_path: Path) -> None:
    refused = calibrate(campaign, tmp_path / "none.json", "--structure", "joint", "--runs", "1,2,3")
    assert refused.exit_code == 1
    assert "no regression (joint) can be made of 3 runs" in str(refused.exception)
    assert not (tmp_path / "none.json").exists()


@pytest.mark.parametrize("option", [("--bands", "widest"), ("--structure", "cubic")])
def test_an_unknown_name_is_a_usage_error(option: tuple[str, str], campaign: Path, tmp_path: Path) -> None:
    refused = calibrate(campaign, tmp_path / "none.json", *option)
    assert refused.exit_code == 2
    assert "is not one of" in refused.output
