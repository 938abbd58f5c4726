"""springscale calibration show: what it says of a file."""

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

from gateway.calibration.file import CalibrationFile, load_calibration
from gateway.cli.calibration import calibration as calibration_commands
from gateway.cli.calibration import figures_of
from gateway.core.ratio_index.regression import term_columns

SHIPPED = Path(__file__).parents[2] / "gateway" / "demo" / "paper_van.json"


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(calibration_commands, [str(argument) for argument in arguments])


def written(path: Path, file: CalibrationFile, change: Callable[[dict[str, Any]], Any] | None = None) -> Path:
    content = json.loads(file.to_json())
    if change:
        change(content)
    path.write_text(json.dumps(content) if change else file.to_json())
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
    assert shown["provenance"] == json.loads(file.to_json())["provenance"]
    assert shown["vehicle"]["empty_mass_kg"] == 1240.0


def test_parameters_are_shown_in_their_units() -> None:
    part = load_calibration(SHIPPED).for_core().cross_spectrum
    at = part.names.index("spring_front_npm")
    spring_npm = math.exp(part.parameters[at])
    std_npm = spring_npm * math.sqrt(part.covariance[at, at])
    shown = re.search(r"spring_front_npm +(\S+) ± (\S+)", run("show", SHIPPED).output)
    assert [float(number) for number in shown.groups()] == pytest.approx([spring_npm, std_npm], rel=0.05)


@given(st.floats(0.3, 3.0), st.floats(0.3, 3.0))
def test_the_figures_of_a_regression_predict_what_it_predicts(ra: float, rg: float) -> None:
    """Constant plus coefficients times the terms as they are: the model's own answer, whatever its scaling."""
    file = load_calibration(SHIPPED)
    assert file.ratio_index.payload is not None
    model = file.ratio_index.payload
    constant, *slopes = (centre for _, centre, _ in figures_of(file)["ratio_index.payload"])
    terms = term_columns(model.terms, np.array([ra]), np.array([rg]))[0]
    assert constant + float(np.dot(slopes, terms)) == pytest.approx(model.predict(ra, rg)[0], rel=1e-9, abs=1e-6)
