"""docs/calibration.md tells every refusal of a tare, and its bounds as they are."""

import re
from pathlib import Path

from gateway.calibration.tare_file import MOST_ENTRIES
from gateway.cli.asked.tare import CLEAR_STDS
from gateway.core.tare import MOST_FRONT_SHARE_PCT, MOST_PAYLOAD_SHARE, MOST_STD_SHARE, Refusal

PAGE = (Path(__file__).parents[2] / "docs" / "calibration.md").read_text(encoding="utf-8")


def test_every_refusal_is_explained_and_no_other() -> None:
    table = PAGE[PAGE.index("| reason | what it means") :].split("\n\n")[0]
    assert re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) == [str(each) for each in Refusal]


def test_the_bounds_are_those_of_the_code() -> None:
    large = (
        f"more than {MOST_PAYLOAD_SHARE:.0%} of the empty sprung mass, or {MOST_FRONT_SHARE_PCT:g} percentage points"
    )
    assert large.replace("%", " %") in PAGE
    assert MOST_STD_SHARE == 0.5
    assert "above half of these bounds" in PAGE
    assert f"the last {MOST_ENTRIES} tares" in PAGE
    assert CLEAR_STDS == 2.0
    assert "within twice its own" in PAGE
