"""A calibration file of any content is used or refused in words: nothing else."""

import json
import re
from pathlib import Path

import pytest
from support.odd_content import N_TRIALS, tried

from gateway.calibration.file import load_calibration
from gateway.errors import CalibrationFileError

GOOD = json.loads((Path(__file__).parents[2] / "gateway" / "demo" / "paper_van.json").read_text())


def test_any_content_is_used_or_refused_in_words(tmp_path: Path) -> None:
    n_used, refusals = tried(GOOD, tmp_path / "vehicle.json", lambda path: load_calibration(path).for_core())
    assert min(n_used, len(refusals)) > N_TRIALS / 10


@pytest.mark.parametrize("text", ["[" * 100_000, '{"id": ' + "9" * 5000 + "}", '{"format": "\\ud83d"}', "\ufeff{}", ""])
def test_what_json_can_hold_but_we_cannot_is_refused_in_words(tmp_path: Path, text: str) -> None:
    path = tmp_path / "vehicle.json"
    path.write_text(text)
    with pytest.raises(CalibrationFileError, match=re.escape(str(path))):
        load_calibration(path)
