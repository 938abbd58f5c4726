"""A calibration file of any content, its hash made to fit, is used or refused in words: nothing else."""

import json
import random
import re
from pathlib import Path

import pytest
from support.odd_content import GONE, ODD, changed, places

from gateway.calibration.file.calibration_file import content_id, load_calibration
from gateway.errors import CalibrationFileError

GOOD = json.loads((Path(__file__).parents[2] / "gateway" / "demo" / "paper_van.json").read_text())
N_TRIALS = 120


def test_any_content_is_used_or_refused_in_words(tmp_path: Path) -> None:
    dice = random.Random(58)
    all_places = list(places(GOOD))
    path, n_used, refusals = tmp_path / "vehicle.json", 0, []
    for _ in range(N_TRIALS):
        content = changed(GOOD, dice.choice(all_places), dice.choice((*ODD, GONE)))
        content["id"] = content_id(content)
        path.write_text(json.dumps(content))
        try:
            load_calibration(path).for_core()
            n_used += 1
        except CalibrationFileError as fault:
            refusals.append(str(fault))
    assert all(str(path) in refusal for refusal in refusals)
    assert min(n_used, len(refusals)) > N_TRIALS / 10


@pytest.mark.parametrize("text", ["[" * 100_000, '{"id": ' + "9" * 5000 + "}", '{"format": "\\ud83d"}', "\ufeff{}", ""])
def test_what_json_can_hold_but_we_cannot_is_refused_in_words(tmp_path: Path, text: str) -> None:
    path = tmp_path / "vehicle.json"
    path.write_text(text)
    with pytest.raises(CalibrationFileError, match=re.escape(str(path))):
        load_calibration(path)
