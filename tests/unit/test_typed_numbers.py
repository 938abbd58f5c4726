"""Numbers on the command line: nan and inf are none, whatever their range; one line says so, and nothing is asked."""

import pytest
from click.testing import CliRunner

from gateway.cli import springscale

NOWHERE = ("--url", "http://127.0.0.1:9")


@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "much"])
@pytest.mark.parametrize(
    "command",
    [
        ("estimate", "drive.log", "--signals", "springscale:reference", "--window-s"),
        ("calibration", "sprung", "--rear-axle-kg", "700", "--front-axle-kg"),
        ("commission", "start", *NOWHERE, "--sensor-m"),
        ("demo", "--once", "--speed"),
        ("record", "bus", "a.log", "--signals", "x", "--interface", "virtual", "--channel", "x", "--for-s"),
        ("simulate", "campaign", "paper", "somewhere", "--longest-s"),
    ],
)
def test_what_is_no_number_is_a_usage_error(command: tuple[str, ...], text: str) -> None:
    said = CliRunner().invoke(springscale, [*command, text])
    assert said.exit_code == 2
    assert f"Invalid value for '{command[-1]}'" in said.output


@pytest.mark.parametrize("command", [("verification", "record", "--load"), ("calibration", "ticket", "add")])
@pytest.mark.parametrize("text", ["nan", "inf", "much"])
def test_a_known_weight_that_is_no_number_is_a_usage_error(command: tuple[str, ...], text: str) -> None:
    said = CliRunner().invoke(springscale, [*command, f"gross_kg={text}", *NOWHERE])
    assert said.exit_code == 2
    assert f"gross_kg = {text!r} is no number" in said.output
