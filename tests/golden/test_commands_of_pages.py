"""Every command that the pages of ways in tell: which test runs it, or that the page says it was not run.

A command that is added to one of these pages needs its line here. Of all pages our own commands must exist, with the
options that are told, and a test must run each.
"""

import re
from pathlib import Path

import click
import pytest

from benchmarks.accuracy.__main__ import studies
from gateway.cli import springscale

ROOT = Path(__file__).parents[2]
PAGES = ("hardware", "feed", "contribute", "faults")
PROGRAMS = (
    r"(?:springscale|python[\d.]*|sudo|cat|systemctl|echo|make|npm|pip|vspec|databroker|mmdebstrap|podman"
    r"|[\w/-]+/bin/\w+|\w+=\S+ python)"
)
PACK, FEED = "tests/unit/test_campaign_pack.py", "tests/vm/test_9_feed.py"
BY_A_STUDY = "benchmarks"  # what writes numbers that a page shows; run where they are made anew
RUN_BY = {  # how a command begins: what runs it
    "python examples/phone.py": "tests/e2e/test_example.py",
    "springscale feed": FEED,
    "springscale look": "tests/unit/test_look.py",
    "springscale record": "tests/unit/test_record_command.py",
    "springscale calibrate campaign.toml --check": "tests/unit/test_inspection_campaign.py",
    "springscale campaign pack": PACK,
    "springscale calibrate my-van.zip": PACK,
    "springscale evaluate my-van.zip": PACK,
    "springscale calibration sprung": "tests/unit/test_vehicle_statics.py",
    "python -m pytest tests/real": "tests/real/test_real_prometheus.py",
    "SPRINGSCALE_HASS=ha/bin/hass python -m pytest": "tests/real/test_real_home_assistant.py",
    "make test-vm": FEED,
    "systemctl status springscale-feed": FEED,
    "python -m benchmarks.": BY_A_STUDY,
}
OWN_RUN_BY = {  # of every page: how a command of ours begins, and what runs it
    "springscale calibrate": "tests/golden/test_recorded_roll.py",
    "springscale calibration sprung": "tests/unit/test_vehicle_statics.py",
    "springscale calibration tare": "tests/unit/test_known_weights_command.py",
    "springscale calibration ticket": "tests/unit/test_known_weights_command.py",
    "springscale calibration": "tests/unit/test_calibration_commands.py",
    "springscale campaign pack": PACK,
    "springscale check-config": "tests/unit/test_command_line.py",
    "springscale commission": "tests/unit/test_commission_command.py",
    "springscale demo": "tests/e2e/test_cli_demo.py",
    "springscale estimate": "tests/unit/test_estimate_command.py",
    "springscale evaluate": "tests/golden/test_recorded_roll.py",
    "springscale events": "tests/unit/test_events_command.py",
    "springscale feed": FEED,
    "springscale fleet-report": "tests/e2e/test_archive_to_report.py",
    "springscale learn": "tests/e2e/test_learn.py",
    "springscale look": "tests/unit/test_look.py",
    "springscale record": "tests/unit/test_record_command.py",
    "springscale replay": "tests/e2e/test_cli_simulate.py",
    "springscale reprocess": "tests/unit/test_archive_command.py",
    "springscale reproduce": "tests/e2e/test_reproduce.py",
    "springscale run": "tests/e2e/test_gateway_service.py",
    "springscale simulate": "tests/e2e/test_cli_simulate.py",
    "springscale token": "tests/unit/test_web_tokens.py",
    "springscale verification": "tests/e2e/test_verification_service.py",
}
NOT_RUN = {  # how a command begins: what the page says of it
    "sudo apt install gpsd": "a real Raspberry Pi",
    "sudo cp deploy/": "a real Raspberry Pi",
    "echo 'FEED_OPTIONS=": "a real Raspberry Pi",
    "sudo systemctl enable --now springscale-feed": "a real Raspberry Pi",
    "cat /sys/bus/iio": "a real Raspberry Pi",
    "python3.13 -m venv ha": "by hand",
    "ha/bin/uv pip install": "by hand",
    "npm install node-red": "by hand",
    "mmdebstrap": "by hand",
    "podman build": "by hand",
}


def text_of(page: str) -> str:
    path = ROOT / "README.md" if page == "README" else ROOT / f"docs/{page}.md"
    return path.read_text(encoding="utf-8").replace("\\\n", " ")


def commands_of(page: str) -> list[str]:
    """In indented lines, and between backticks."""
    prose = re.sub(r"```.*?```", "", text_of(page), flags=re.DOTALL)
    told = re.findall(rf"^ {{4,}}({PROGRAMS} .*)$", prose, re.MULTILINE)
    told += re.findall(rf"`({PROGRAMS} [^`\n]*)`", prose)
    return [" ".join(one.partition("  #")[0].split()) for one in told]


COMMANDS = [(page, command) for page in PAGES for command in commands_of(page)]


@pytest.mark.parametrize(("page", "command"), COMMANDS)
def test_a_test_runs_it_or_the_page_says_that_none_does(page: str, command: str) -> None:
    runner = next((where for beginning, where in RUN_BY.items() if command.startswith(beginning)), None)
    if runner is None:
        said = next((text for beginning, text in NOT_RUN.items() if command.startswith(beginning)), None)
        assert said is not None, f"neither a test that runs it nor words that it was not run: {command}"
        assert said in " ".join(text_of(page).split())
    else:
        assert (ROOT / runner).exists()


OUR_OWN = [
    (page.stem, command)
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
    for command in commands_of(page.stem)
    if re.match("(springscale|python -m benchmarks.accuracy) [a-z]", command)
]


@pytest.mark.parametrize(("page", "command"), OUR_OWN)
def test_our_own_commands_have_the_options_that_are_told(page: str, command: str) -> None:
    words = command.removeprefix("python -m benchmarks.accuracy").removeprefix("springscale").split()
    found: click.Command = springscale if command.startswith("springscale") else studies
    while isinstance(found, click.Group) and words:
        known = found.get_command(click.Context(found), words.pop(0))
        assert known is not None, f"{page}: {command}"
        found = known
    options = {name for one in found.params for name in one.opts}
    assert {word for word in words if word.startswith("--")} <= options


@pytest.mark.parametrize("command", sorted({one for _, one in OUR_OWN if one.startswith("springscale")}))
def test_a_test_runs_each_of_our_own_commands(command: str) -> None:
    runner = next((where for beginning, where in OWN_RUN_BY.items() if command.startswith(beginning)), None)
    assert runner is not None, command
    text = (ROOT / runner).read_text(encoding="utf-8")
    assert all(word in text for word in command.split()[1:2])


def test_commands_are_found_in_every_page() -> None:
    assert {page for page, _ in COMMANDS} == set(PAGES)
    told = [command for _, command in COMMANDS]
    unused = [beginning for beginning in (*RUN_BY, *NOT_RUN) if not any(one.startswith(beginning) for one in told)]
    assert unused == []
