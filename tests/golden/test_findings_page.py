"""docs/findings.md explains every finding there is, and the code finds each of them."""

import re
from pathlib import Path

import pytest

from gateway.calibration.inspection.finding import Finding, Kind, Severity

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "findings.md").read_text(encoding="utf-8")


def test_every_finding_is_explained_once() -> None:
    assert sorted(re.findall(r"^\| `(\w+)`", PAGE, re.MULTILINE)) == sorted(Kind)
    assert all(kind.means and kind.advice and kind.severities for kind in Kind)


@pytest.mark.parametrize("kind", Kind)
def test_every_finding_is_found_somewhere_in_the_code(kind: Kind) -> None:
    room = ROOT / "gateway/calibration/inspection"
    code = "".join(path.read_text(encoding="utf-8") for path in room.glob("*.py"))
    assert re.search(rf"Kind\.{kind.name}\b", code)


def test_a_finding_has_no_other_weight_than_the_page_says() -> None:
    with pytest.raises(ValueError, match="smooth_road is never a fault"):
        Finding.of(Kind.SMOOTH_ROAD, "", Severity.FAULT)
