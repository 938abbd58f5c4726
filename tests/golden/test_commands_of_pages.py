"""Every command on a page has a test that runs it, or a line here that says why none does.

Pages of ways in also say in their own words what was not run. Commands of ours must exist, with the options that a page
tells, and a test must run each.
"""

import re
from pathlib import Path

import click
import pytest

from benchmarks.accuracy.__main__ import studies
from gateway.cli import springscale

ROOT = Path(__file__).parents[2]
PAGES = ("hardware", "feed", "contribute", "faults")  # they name what was not run in their own words
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
    "springscale state": "tests/unit/test_state_command.py",
    "springscale token": "tests/unit/test_web_tokens.py",
    "springscale verification": "tests/e2e/test_verification_service.py",
}
NOT_RUN_HERE = {  # how a command of any page begins: why no test runs it
    "cat /var/lib/springscale/record": "joins files of a vehicle",
    "make audit": "asks a server of advisories; a test runs the script against a fake one",
    "make bench": "takes a quarter of an hour; its numbers stand in performance.json",
    "make check": "is what every change runs before it is committed",
    "make docs": "writes what tests compare",
    "make fleet-test": "wants a broker and a database; its counts stand in fleet_test.json",
    "make screenshots": "takes pictures, for eyes",
    "make soak": "takes long; its numbers stand in soak.json",
    "make test": "is the tests",
    "pip install": "asks an index; the lists of packages are tested",
    "python -m pytest": "is the tests",
    "sudo -u postgres": "a server's set-up; tests make the same database without sudo",
    "sudo /opt/springscale-subscriber": "a server's set-up",
    "sudo apt install mosquitto": "a server's set-up",
    "sudo apt install postgresql": "a server's set-up",
    "sudo chown 1883": "a server's set-up",
    "sudo cp subscriber/": "a server's set-up; a test reads the unit",
    "sudo python3 -m venv /opt": "a server's set-up",
    "sudo sh -c 'modprobe vcan": "wants root and the vcan module; tests/vm plays a log onto a vcan0 of its own",
    "sudo systemctl edit springscale": "opens an editor",
    "sudo useradd": "a server's set-up",
    'echo "whsec_': "wants root; a test makes a secret of the same form",
}
ANY_RUN_BY = {  # the same of what tests run
    "make deb": "tests/e2e/test_vehicle_packages.py",
    "make demo": "tests/e2e/test_cli_demo.py",
    "make dist": "tests/e2e/test_dist.py",
    "python docs/make.py": "tests/golden/test_reference_pages.py",
    "python docs/make_tutorial.py": "tests/golden/test_tutorial.py",
    "python -m benchmarks.": BY_A_STUDY,
    "python -m gateway.fleet.subscriber": "tests/support/fleet_view.py",
    "python3 provision.py": "tests/unit/test_fleet_files.py",
    "springscale --help": "tests/unit/test_command_line.py",
    "springscale -V": "tests/unit/test_command_line.py",
    "springscale COMMAND": "tests/unit/test_command_line.py",
    "sudo apt install ./build/springscale": "tests/vm/harness/vehicle.py",
    "sudo cp /usr/share/springscale/network": "tests/vm/harness/vehicle.py",
    "sudo springscale token create": "tests/vm/harness/vehicle.py",
    "sudo systemctl enable --now springscale": "tests/vm/harness/vehicle.py",
    "systemctl restart springscale": "tests/vm/harness/vehicle.py",
    "systemctl status springscale": "tests/vm/harness/vehicle.py",
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


def beginning_of(command: str, *tables: dict[str, str]) -> str | None:
    """What the first of the tables that knows the command says of it."""
    return next((said for table in tables for start, said in table.items() if command.startswith(start)), None)


@pytest.mark.parametrize(("page", "command"), COMMANDS)
def test_a_test_runs_it_or_the_page_says_that_none_does(page: str, command: str) -> None:
    if said := beginning_of(command, NOT_RUN):
        assert said in " ".join(text_of(page).split())
    else:
        test_a_test_runs_it_or_the_table_says_why_none_does(command)


OF_ALL_PAGES = sorted({each for page in (ROOT / "docs").glob("*.md") for each in commands_of(page.stem)})


@pytest.mark.parametrize("command", OF_ALL_PAGES)
def test_a_test_runs_it_or_the_table_says_why_none_does(command: str) -> None:
    runner = beginning_of(command, RUN_BY, OWN_RUN_BY, ANY_RUN_BY)
    if runner is None:
        assert beginning_of(command, NOT_RUN, NOT_RUN_HERE), f"neither a test that runs it nor why none does: {command}"
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
    unused += [one for one in (*ANY_RUN_BY, *NOT_RUN_HERE) if not any(each.startswith(one) for each in OF_ALL_PAGES)]
    assert unused == []
