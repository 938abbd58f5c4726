"""An estimate as a line for people."""

from dataclasses import replace

from support.estimates import make_estimate

from gateway.cli.estimate import sentence
from gateway.estimate import UNKNOWN, Estimate, Quantity, Weight, Weights
from gateway.estimate_json import estimate_to_json
from gateway.records import Why

ANSWER = replace(make_estimate(0), front_share=Quantity(50.5, 0.2, (50.1, 50.9)))


def line(estimate: Estimate) -> str:
    return sentence(estimate_to_json(estimate))


def test_a_line_says_when_how_much_and_how_sure() -> None:
    assert line(ANSWER) == (
        "1970-01-01T00:00:00Z  payload   100.0 kg ±  12.0 (95 %)   front share 50.50 % ± 0.40 (95 %)    50.4 km/h"
    )


def test_what_the_calibration_does_not_hold_is_said_to_be_unknown() -> None:
    """Loads all at one place calibrate the ratio index for payload alone."""
    assert line(replace(ANSWER, front_share=UNKNOWN)) == (
        "1970-01-01T00:00:00Z  payload   100.0 kg ±  12.0 (95 %)   front share unknown    50.4 km/h"
    )
    assert "payload unknown   front share 50.50 % ± 0.40 (95 %)" in line(replace(ANSWER, payload=UNKNOWN))


def test_where_the_load_lies_sideways_is_said_where_something_tells() -> None:
    aside = replace(ANSWER, cg_left=Quantity(-0.035, 0.004, (-0.043, -0.027)))
    assert "(95 %)     -35 mm left ±   8 (95 %)    50.4 km/h" in line(aside)
    assert "mm" not in line(ANSWER)


def test_a_refusal_says_why() -> None:
    assert line(make_estimate(0, Why.AMBIGUOUS)) == "1970-01-01T00:00:00Z  no estimate: ambiguous"


def test_too_much_is_said_last() -> None:
    heavy = Weights(gross=Weight(2010.0, 6.0, 2000.0, None), rear_axle=Weight(1120.0, 5.0, 1100.0, None))
    assert line(replace(ANSWER, weights=heavy)).endswith(" 50.4 km/h   over the limit: gross, rear axle")
