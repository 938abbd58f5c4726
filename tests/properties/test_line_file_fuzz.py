"""A line file says what was built, and one of any content, its hash made to fit, is used or refused in words."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.half_car_road import VAN
from support.odd_content import tried

from gateway.calibration.file.hashed import content_id
from gateway.calibration.file.line_file import LineFile, SiblingPart, load_like
from gateway.calibration.half_car.prior import prior_of
from gateway.calibration.inheritance import ModelLimits, Seen, Usual
from gateway.calibration.line.evidence import Evidence
from gateway.calibration.line.line import Line
from gateway.calibration.line.scatter import default_scatter_std, is_inherited
from gateway.calibration.line_files import line_of_files, line_part
from gateway.core.cross_spectrum.model.parameters import PARAMETERS, ROLL_PARAMETERS
from gateway.core.vehicle import Load
from gateway.errors import CalibrationFileError


def line() -> Line:
    """Of drives that halved every standard deviation of what is inherited."""
    prior = prior_of(VAN)
    shared = is_inherited(PARAMETERS)
    return Line(
        members=("sha256:" + 64 * "a",),
        wheelbase_m=VAN.wheelbase_m,
        empty_mass_kg=VAN.empty_mass_kg,
        usual=Usual(-4.0, (0.06, 0.05)),
        half_car=Evidence.of(prior.mean, 0.25 * prior.covariance, prior, shared),
        roll=None,
        scatter_std=default_scatter_std(PARAMETERS + ROLL_PARAMETERS),
        n_siblings=0,
        seen=Seen((0.0, 400.0), (40.0, 55.0), (13.0, 15.0), 0.8, 0.02, (Load(0.0, 52.0), Load(400.0, 41.0))),
        limits=ModelLimits((10.0, 0.2, 0.002), (3.0, 3.0), 5.0, 6.0, 6.0),
    )


def line_file() -> LineFile:
    sibling = SiblingPart(id="sha256:" + 64 * "a", name="van", empty_mass_kg=1240.0, n_runs=10)
    return LineFile(software="springscale", siblings=(sibling,), line=line_part(line()))


def test_what_is_written_is_read(tmp_path: Path) -> None:
    path = tmp_path / "line.json"
    path.write_text(line_file().to_json())
    held = load_like(path)
    assert held.id == line_file().id
    read, built = line_of_files([held]), line()
    assert (read.members, read.usual, read.seen) == (built.members, built.usual, built.seen)
    assert read.limits == built.limits
    assert np.array_equal(read.half_car.information, built.half_car.information)
    assert np.array_equal(read.half_car.pull, built.half_car.pull)
    assert np.array_equal(read.scatter_std, built.scatter_std)
    assert read.roll is None


def test_a_file_of_another_version_is_refused(tmp_path: Path) -> None:
    content = json.loads(line_file().to_json()) | {"version": 1}
    content["id"] = content_id(content)
    path = tmp_path / "line.json"
    path.write_text(json.dumps(content))
    with pytest.raises(CalibrationFileError, match="version 1"):
        load_like(path)


@pytest.mark.filterwarnings("ignore:overflow")  # numbers of 1e308 are finite
def test_any_content_is_used_or_refused_in_words(tmp_path: Path) -> None:
    good = json.loads(line_file().to_json())
    n_used, refusals = tried(good, tmp_path / "line.json", lambda path: line_of_files([load_like(path)]))
    assert n_used > 3
    assert len(refusals) > 40
