"""docs/known-weights.md explains every refusal, and its numbers are those of the code."""

import re
from pathlib import Path

from gateway.calibration.known_weight import STD_KG, WeightRefusal
from gateway.calibration.known_weights_file import MOST_KNOWN_WEIGHTS
from gateway.core.known_weights import CONTRADICTED

PAGE = (Path(__file__).parents[2] / "docs" / "known-weights.md").read_text(encoding="utf-8")


def test_every_refusal_is_explained_and_no_other() -> None:
    table = PAGE[PAGE.index("| reason | what to do") :].split("\n\n")[0]
    assert set(re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)) == {str(each) for each in WeightRefusal}


def test_the_numbers_are_those_of_the_code() -> None:
    usual = re.findall(r"^\| `(\w+)` \|.*\| (\d+) kg", PAGE, re.MULTILINE)
    assert {kind: float(kg) for kind, kg in usual} == {str(kind): kg for kind, kg in STD_KG.items()}
    assert f"Beyond {MOST_KNOWN_WEIGHTS} entries it forgets the oldest" in PAGE
    assert CONTRADICTED == 3.0
    assert "more than three standard deviations" in PAGE
