"""docs/calibration.schema.json says what gateway/calibration writes, and what it writes keeps to it."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema_rs
import pytest
from reference import DIALECT
from support.calibrated import calibration_file

from gateway.calibration.file import load_calibration

ROOT = Path(__file__).parents[2]
PUBLISHED = (ROOT / "docs" / "calibration.schema.json").read_text(encoding="utf-8")
VALIDATOR = jsonschema_rs.validator_for(json.loads(PUBLISHED))


def test_it_is_a_schema_of_its_dialect() -> None:
    assert json.loads(PUBLISHED)["$schema"] == DIALECT
    jsonschema_rs.meta.validate(json.loads(PUBLISHED))


def test_what_is_written_keeps_to_it() -> None:
    VALIDATOR.validate(json.loads(calibration_file().to_json()))


def test_the_shipped_calibration_keeps_to_it() -> None:
    VALIDATOR.validate(json.loads(load_calibration(ROOT / "gateway" / "demo" / "paper_van.json").to_json()))


WRONG: list[Callable[[dict[str, Any]], Any]] = [
    lambda c: c.pop("vehicle"),
    lambda c: c.update(id="abc"),
    lambda c: c.update(version=2),
    lambda c: c["provenance"]["drives"][0].pop("statement"),
    lambda c: c.update(colour="red"),
    lambda c: c["seen"].pop("roughness_mps2"),
    lambda c: c["vehicle"].update(wheelbase_m="2.8"),
    lambda c: c["ratio_index"]["payload"].update(lows=["zero"]),
]


@pytest.mark.parametrize("change", WRONG)
def test_what_is_never_written_does_not(change: Callable[[dict[str, Any]], Any]) -> None:
    content = copy.deepcopy(json.loads(calibration_file().to_json()))
    change(content)
    assert not VALIDATOR.is_valid(content)
