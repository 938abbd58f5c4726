"""What stands behind ± spans 95 %, wherever a person reads it; where it is a standard deviation it says so."""

import re

from support.estimates import make_record

from gateway.calibration.plan.loads import PlacedLoad
from gateway.calibration.plan.plan import Advice, Expected, LoadPlan
from gateway.cli.calibrate import plan_sentences
from gateway.cli.estimate import sentence
from gateway.core.cross_spectrum.predicted import Drive
from gateway.reports.calibration.runs import best_next, plan_section

EXPECTED = Expected(payload_std_kg=10.0, front_share_std_pct=0.5, reach_share=0.4)
PLAN = LoadPlan("van", 3, Drive(600.0, 14.0), EXPECTED, (Advice(PlacedLoad(300.0, 50.0, 1.4), EXPECTED),), None)


def spreads(text: str) -> set[float]:
    return {float(each) for each in re.findall(r"(?:±|\+-)\s*([\d.]+)", text)}


def test_an_estimates_line() -> None:
    record = make_record(0) | {"front_share_interval95_pct": [50.1, 50.9], "front_share_std_pct": 0.2}
    assert spreads(sentence(record)) == {12.0, 0.4}
    assert sentence(record).count("(95 %)") == 2


def test_a_plan() -> None:
    said = plan_sentences(PLAN)
    assert spreads(said) == {20.0, 1.0}
    assert said.count("(95 %)") == 2


def test_a_reports_plan() -> None:
    (table,) = plan_section(PLAN).tables
    assert "± spans 95 %" in table.caption
    assert spreads(" ".join(table.rows[0])) == {19.6, 0.98}
    assert "(95 %)" in (best_next(PLAN) or "")
