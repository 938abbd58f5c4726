"""docs/findings.md explains every finding there is, and the code finds each of them."""

import re
from pathlib import Path

import pytest

from gateway.calibration.inspection import Severity
from gateway.calibration.inspection.explained import EXPLAINED, finding_of
from gateway.calibration.inspection.finding import Kind

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "findings.md").read_text(encoding="utf-8")


def test_every_finding_is_explained_once() -> None:
    assert sorted(re.findall(r"^\| `(\w+)`", PAGE, re.MULTILINE)) == sorted(Kind)
    assert all(explained.means and explained.advice and explained.severities for explained in EXPLAINED.values())


@pytest.mark.parametrize("kind", Kind)
def test_every_finding_is_found_somewhere_in_the_code(kind: Kind) -> None:
    room = ROOT / "gateway/calibration/inspection"
    code = "".join(path.read_text(encoding="utf-8") for path in room.glob("*.py"))
    assert code.count(f"Kind.{kind.name}") >= 2  # its explanation, and where it is found


def test_a_finding_has_no_other_weight_than_the_page_says() -> None:
    with pytest.raises(ValueError, match="smooth_road is never a fault"):
        finding_of(Kind.SMOOTH_ROAD, Severity.FAULT, "")
