"""The tutorial's commands work as they stand on the page, and print what it says."""

import shutil

import make_tutorial
import pytest


@pytest.mark.skipif(shutil.which("curl") is None, reason="the tutorial asks the service with curl")
def test_the_tutorial_does_what_it_says() -> None:
    page = make_tutorial.PAGE.read_text(encoding="utf-8")
    now = make_tutorial.with_outputs(page)
    assert now == page, "run `python docs/make_tutorial.py` and read whether its words still hold"


@pytest.mark.parametrize(
    ("printed", "is_same"),
    [
        ("payload 16.7 kg, id ab", True),
        ("payload 17.0 kg, id ab", False),  # more than the last digit
        ("payload 16.8 kg, id cd", True),  # the rule says so
        ("payload 16.8 lb, id ab", False),
    ],
)
def test_only_the_last_digit_and_named_values_may_differ(printed: str, is_same: bool) -> None:
    assert make_tutorial.is_same("payload 16.8 kg, id ef", printed, r"id [a-f]+") is is_same
