"""springscale calibration show, diff and verify: what they say of a file, and how they end."""

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from hypothesis import given
from hypothesis import strategies as st
from support.calibrated import calibration_file

from gateway.calibration.campaign import file_sha256, load_campaign
from gateway.calibration.file.calibration_file import CalibrationFile, load_calibration
from gateway.calibration.file.comparison import FittedFigure, check_against_campaign, differences, figures_of
from gateway.calibration.file.hashed import content_id
from gateway.cli.calibration import calibration as calibration_commands
from gateway.core.ratio_index.regression import term_columns
from gateway.errors import CalibrationFileError

SHIPPED = Path(__file__).parents[2] / "gateway" / "demo" / "paper_van.json"


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(calibration_commands, [str(argument) for argument in arguments])


def written(path: Path, file: CalibrationFile, change: Callable[[dict[str, Any]], Any] | None = None) -> Path:
    content = json.loads(file.to_json())
    if change:
        change(content)
        content["id"] = content_id(content)
    path.write_text(json.dumps(content))
    return path


def test_show_says_what_a_person_asks(tmp_path: Path) -> None:
    file = calibration_file()
    text = run("show", written(tmp_path / "van.json", file)).output
    for said in (
        file.id,
        "empty_mass_kg               1240",
        "0 to 400",
        "46 to 50",
        "roughness_mps2              unknown",
    ):
        assert said in text
    for said in ("constant                             200 ± 0", "a.log", "springscale calibrate", "warnings\n  none"):
        assert said in text


def test_show_json_is_the_file(tmp_path: Path) -> None:
    file = calibration_file()
    shown = json.loads(run("show", "--json", written(tmp_path / "van.json", file)).output)
    assert shown == json.loads(file.to_json())


def test_half_car_parameters_are_shown_in_their_units() -> None:
    part = load_calibration(SHIPPED).for_core().cross_spectrum
    at = part.names.index("spring_front_npm")
    spring_npm = math.exp(part.parameters[at])
    std_npm = spring_npm * math.sqrt(part.covariance[at, at])
    shown = re.search(r"spring_front_npm +(\S+) ± (\S+)", run("show", SHIPPED).output)
    assert [float(number) for number in shown.groups()] == pytest.approx([spring_npm, std_npm], rel=0.05)


def test_a_parameter_held_as_a_logarithm_has_a_spread_of_first_order() -> None:
    assert FittedFigure("k", 200.0, 20.0, True).distance(FittedFigure("k", 200.0, 1.0, True)) == 0.0
    assert FittedFigure("k", 100.0, 3.0, True).distance(FittedFigure("k", 271.828182846, 0.0, True)) == pytest.approx(
        1.0 / 0.03
    )
    assert FittedFigure("k", -1.0, 3.0).distance(FittedFigure("k", 9.0, 4.0)) == pytest.approx(2.0)
    assert FittedFigure("k", 1.0, 0.0).distance(FittedFigure("k", 2.0, 0.0)) == float("inf")


def test_a_file_does_not_differ_from_itself(tmp_path: Path) -> None:
    path = written(tmp_path / "van.json", calibration_file())
    found = run("diff", path, path)
    assert (found.exit_code, found.output) == (0, f"identical: {calibration_file().id}\n")
    assert json.loads(run("diff", "--json", path, path).output)["is_identical"] is True
    assert differences(calibration_file(), calibration_file()) == ()


def with_gram(payload_kg: float, gram: float) -> CalibrationFile:
    """The made-up file, its payload regression known as well as ``gram`` says."""
    content = json.loads(calibration_file(payload_kg).to_json())
    del content["id"]
    content["ratio_index"]["payload"]["gram_inverse"] = [[gram, 0.0], [0.0, gram]]
    return CalibrationFile.model_validate(content)


def test_diff_tells_figures_in_combined_standard_deviations() -> None:
    """The term is scaled from 0..1 to -1..1, so the constant is b_0 - b_1: its variance is 10^2 (1/4 + 1/4) kg^2."""
    one, other = with_gram(200.0, 0.25), with_gram(230.0, 0.25)
    (found,) = differences(one, other)
    assert (found.where, found.one, found.other) == ("ratio_index.payload.constant", 200.0, 230.0)
    (mine,) = [figure for figure in figures_of(one)["ratio_index.payload"] if figure.name == "constant"]
    assert mine.std == pytest.approx(50.0**0.5)
    assert found.n_std == pytest.approx(30.0 / 100.0**0.5)


@given(st.floats(0.3, 3.0), st.floats(0.3, 3.0))
def test_the_figures_of_a_regression_predict_what_it_predicts(ra: float, rg: float) -> None:
    """Constant plus coefficients times the terms as they are: the model's own answer, whatever its scaling."""
    file = load_calibration(SHIPPED)
    assert file.ratio_index.payload is not None
    model = file.ratio_index.payload
    constant, *slopes = (figure.centre for figure in figures_of(file)["ratio_index.payload"])
    terms = term_columns(model.terms, np.array([ra]), np.array([rg]))[0]
    assert constant + float(np.dot(slopes, terms)) == pytest.approx(model.predict(ra, rg)[0], rel=1e-9, abs=1e-6)


def test_diff_tells_ranges_vehicle_and_warnings(tmp_path: Path) -> None:
    one = written(tmp_path / "one.json", calibration_file())

    def change(content: dict[str, Any]) -> None:
        content["seen"]["payload_kg"] = [0.0, 300.0]
        content["vehicle"]["wheelbase_m"] = 2.9
        content["warnings"] = ["intervals_untested"]
        content["provenance"]["runs"][0]["sha256"] = "f" * 64

    other = written(tmp_path / "other.json", calibration_file(), change)
    found = run("diff", one, other)
    assert found.exit_code == 0
    assert found.output.splitlines() == [
        "vehicle.wheelbase_m: 2.8 -> 2.9",
        "seen.payload_kg: [0, 400] -> [0, 300]",
        "warnings: [] -> [intervals_untested]",
        f"provenance.runs[1].sha256: {'0' * 64} -> {'f' * 64}",
    ]


def test_what_only_one_file_holds_is_a_difference(tmp_path: Path) -> None:
    one = written(tmp_path / "one.json", calibration_file())
    other = written(tmp_path / "other.json", calibration_file(), lambda c: c["ratio_index"].update(front_share=None))
    listed = json.loads(run("diff", "--json", one, other).output)["differences"]
    assert {"where": "ratio_index.front_share.constant", "one": 48.0, "other": None, "n_std": None} in listed


@pytest.mark.parametrize("part", ["cross_spectrum", "expected_errors"])
def test_of_a_part_that_one_file_lacks_the_first_fact_stands_for_all(part: str) -> None:
    whole = load_calibration(SHIPPED)
    told = differences(whole, whole.model_copy(update={part: None}))
    fitted = {f"{name}.{figure.name}" for name, figures in figures_of(whole).items() for figure in figures}
    assert len([one for one in told if one.where not in fitted]) == 1


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    """One empty run whose log is ten bytes."""
    (tmp_path / "a.log").write_bytes(b"0123456789")
    (tmp_path / "signals.toml").write_text("")
    path = tmp_path / "campaign.toml"
    path.write_text(
        'signals = "signals.toml"\n[vehicle]\nname = "van"\nempty_mass_kg = 1240.0\nwheelbase_m = 2.8\n'
        'sensor_position_m = 3.2\n[[runs]]\nlog = "a.log"\npayload_kg = 0.0\n'
    )
    return path


def made_from(campaign: Path, *, n_runs: int = 1) -> CalibrationFile:
    content = json.loads(calibration_file().to_json())
    del content["id"]
    (run_part,) = content["provenance"]["runs"]
    run_part["sha256"] = file_sha256(campaign.parent / "a.log")
    content["provenance"]["campaign_sha256"] = file_sha256(campaign)
    content["provenance"]["runs"] = [{**run_part, "number": n} for n in range(1, n_runs + 1)]
    return CalibrationFile.model_validate(content)


def test_verify_finds_the_logs_it_was_made_from(tmp_path: Path, campaign: Path) -> None:
    path = written(tmp_path / "van.json", made_from(campaign))
    found = run("verify", path, "--logs", campaign)
    assert found.exit_code == 0, found.output
    assert [line.split()[0] for line in found.output.splitlines()] == ["good"] * 5


FAULTS: list[tuple[Callable[[Path], Any], str]] = [
    (lambda c: (c.parent / "a.log").write_bytes(b"012345678"), "not the log it was calibrated from"),
    (lambda c: c.write_text(c.read_text().replace("payload_kg = 0.0", "payload_kg = 9.0\npayload_position_m = 1.0")),
     "calibrated as 0 kg and 50 %, the campaign says 9 kg"),
    (lambda c: c.write_text(c.read_text().replace("payload_kg = 0.0", "payload_kg = 9.0\nfront_share_pct = 50.0")),
     "calibrated as 0 kg and 50 %, the campaign says 9 kg and 50 %"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "said"), FAULTS)
def test_verify_fails_where_a_log_or_load_is_another(
    tmp_path: Path, campaign: Path, spoil: Callable[[Path], Any], said: str
) -> None:
    path = written(tmp_path / "van.json", made_from(campaign))
    spoil(campaign)
    found = run("verify", path, "--logs", campaign)
    assert found.exit_code == 1
    assert said in found.output
    checks = json.loads(run("verify", path, "--logs", campaign, "--json").output)
    assert checks["is_good"] is False
    assert [check["what"] for check in checks["checks"] if check["verdict"] == "fault"] == ["run 1"]


def test_a_log_that_vanishes_while_it_is_checked_is_a_fault(campaign: Path) -> None:
    loaded = load_campaign(campaign)
    file = made_from(campaign)
    (campaign.parent / "a.log").unlink()
    assert [(check.verdict, "cannot be read" in check.text) for check in check_against_campaign(file, loaded)] == [
        ("good", False),
        ("fault", True),
    ]


def test_a_comment_in_the_campaign_is_a_note_and_a_lost_run_a_fault(tmp_path: Path, campaign: Path) -> None:
    path = written(tmp_path / "van.json", made_from(campaign, n_runs=2))
    campaign.write_text("# again\n" + campaign.read_text())
    found = run("verify", path, "--logs", campaign)
    assert found.exit_code == 1
    assert "note   campaign" in found.output
    assert "the campaign has 1 runs only" in found.output


def test_verify_refuses_a_damaged_file_and_an_unknown_model(tmp_path: Path) -> None:
    path = written(tmp_path / "van.json", calibration_file())
    path.write_text(path.read_text().replace("1240.0", "1241.0"))
    assert isinstance(run("verify", path).exception, CalibrationFileError)
    unknown = written(
        tmp_path / "new.json", calibration_file(), lambda c: c["ratio_index"]["payload"].update(terms=["sinh_ra"])
    )
    fault = run("verify", unknown).exception
    assert isinstance(fault, CalibrationFileError)
    assert "sinh_ra" in str(fault)
    assert fault.exit_code == 2
