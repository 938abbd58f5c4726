"""Every command that README and the pages of docs/ tell: which test runs it, or why none does.

A command that is added to a page needs its line here. Our own commands must exist, with the options that are told,
and a test must run each.
"""

import re
from pathlib import Path

import click
import pytest

from benchmarks.accuracy.__main__ import studies
from gateway.cli import springscale

ROOT = Path(__file__).parents[2]
PAGES = ("README", *sorted(page.stem for page in (ROOT / "docs").glob("*.md")))
PROGRAMS = (
    r"(?:springscale|python[\d.]*|sudo|cat|systemctl|journalctl|echo|eval|curl|canplayer|make|npm|pip|dask|docker|cp"
    r"|\./\w+\.sh|mmdebstrap|podman|[\w/-]+/bin/\w+|\w+=\S+ python)"
)
PACK, FEED = "tests/unit/test_campaign_pack.py", "tests/vm/test_9_feed.py"
DEMO, VM, STUDY = "tests/e2e/test_cli_demo.py", "tests/vm/harness/vehicle.py", "benchmarks"
RUN_BY = {  # how a command begins: what runs it, or makes its numbers anew
    "python examples/phone.py": "tests/e2e/test_example.py",
    "python -m pytest tests/real": "tests/real/test_real_prometheus.py",
    "SPRINGSCALE_HASS=ha/bin/hass python -m pytest": "tests/real/test_real_home_assistant.py",
    "python -m benchmarks.": STUDY,
    "python -m gateway.fleet.subscriber": "tests/support/fleet_view.py",
    "python docs/make_tutorial.py": "tests/golden/test_tutorial.py",
    "python3 provision.py": "tests/unit/test_fleet_files.py",
    "./make_certificates.sh": "tests/support/fleet_view.py",
    "make test-vm": FEED,
    "python3 -m zipfile -e my-van.zip": PACK,
    "make audit": "tests/unit/test_audit_locks.py",
    "make deb": "tests/e2e/test_vehicle_packages.py",
    "make demo": DEMO,
    "make dist": "tests/e2e/test_dist.py",
    "make fleet-test": "tests/fleet/test_fifty_vehicles.py",
    "sudo apt install ./build/": VM,
    "sudo cp /usr/share/springscale/network": VM,
    "sudo springscale token create": VM,
    "sudo systemctl enable --now springscale": VM,
    "systemctl restart springscale": VM,
    "systemctl status springscale": VM,
}
OWN_RUN_BY = {  # how a command of ours begins: what runs it
    "springscale calibrate campaign.toml --check": "tests/unit/test_inspection_campaign.py",
    "springscale calibrate my-van/": PACK,
    "springscale evaluate my-van/": PACK,
    "springscale calibrate": "tests/golden/test_recorded_roll.py",
    "springscale campaign pack": PACK,
    "springscale check-config": "tests/unit/test_command_line.py",
    "springscale demo": DEMO,
    "springscale estimate": "tests/unit/test_estimate_command.py",
    "springscale evaluate": "tests/golden/test_recorded_roll.py",
    "springscale feed": FEED,
    "springscale fleet-report": "tests/e2e/test_archive_to_report.py",
    "springscale learn": "tests/e2e/test_learn.py",
    "springscale look": "tests/unit/test_look.py",
    "springscale record": "tests/unit/test_record_command.py",
    "springscale reprocess": "tests/unit/test_archive_command.py",
    "springscale reproduce": "tests/e2e/test_reproduce.py",
    "springscale run": "tests/e2e/test_gateway_service.py",
    "springscale simulate": "tests/e2e/test_cli_simulate.py",
    "springscale state": "tests/unit/test_state_command.py",
    "springscale token": "tests/contracts/test_web_guard.py",
}
ON_PI = "a real Raspberry Pi"
BY_HAND = "by hand"
SAID = {  # how a command begins that no test runs: the words with which its page says so
    "sudo apt install gpsd": ON_PI,
    "sudo cp deploy/": ON_PI,
    "echo 'FEED_OPTIONS=": ON_PI,
    "sudo systemctl enable --now springscale-feed": ON_PI,
    "cat /sys/bus/iio": ON_PI,
    "python3.13 -m venv ha": BY_HAND,
    "ha/bin/uv pip install": BY_HAND,
    "npm install node-red": BY_HAND,
    "mmdebstrap": BY_HAND,
    "podman build": BY_HAND,
}
ROOT_RIGHTS = "changes the machine, as root"
SERVER = "sets up a server; the tests run the same files without root"
NETWORK = "installs from a package index; `make test` itself runs in such an environment"
BY_OTHERS = "another project's program; the tests send the same requests, or call the same library"
NOT_RUN = {  # how a command begins that no test runs, and why
    "sudo sh -c 'modprobe vcan": ROOT_RIGHTS,
    "sudo systemctl edit springscale": "opens an editor",
    "sudo -u postgres": SERVER,
    "sudo /opt/springscale-subscriber": SERVER,
    "sudo apt install mosquitto": SERVER,
    "sudo apt install postgresql": SERVER,
    "sudo chown 1883": SERVER,
    "sudo cp subscriber/": SERVER,
    "sudo python3 -m venv /opt": SERVER,
    "sudo useradd": SERVER,
    "journalctl": ROOT_RIGHTS,
    'echo "whsec_': ROOT_RIGHTS,
    "pip install": NETWORK,
    "curl ": BY_OTHERS,
    "canplayer": BY_OTHERS,
    "dask ": BY_OTHERS,
    "docker compose": "the test machines run no docker",
    "cp ": "copies files of the reader",
    "cat /var/lib/springscale/record": "joins files of the reader",
    'eval "$(_SPRINGSCALE_COMPLETE': "changes the reader's shell",
    "make bench": "takes a quarter of an hour and writes docs/performance.json",
    "make soak": "takes an hour and writes docs/soak.json",
    "make test": "runs the tests",
    "make check": "runs beside the tests",
    "make docs": "writes the pages that the tests compare",
    "make screenshots": "writes the pictures",
    "python docs/make.py": "writes the pages that `make check` compares",
    "python -m": "names the way to run a module",
}


def text_of(page: str) -> str:
    path = ROOT / "README.md" if page == "README" else ROOT / f"docs/{page}.md"
    return path.read_text(encoding="utf-8").replace("\\\n", " ")


def commands_of(page: str) -> list[str]:
    """The commands in a page's indented lines and between its backticks."""
    prose = re.sub(r"```.*?```", "", text_of(page), flags=re.DOTALL)
    told = re.findall(rf"^ {{4,}}({PROGRAMS} .*)$", prose, re.MULTILINE)
    told += re.findall(rf"`({PROGRAMS} [^`\n]*)`", prose)
    return [" ".join(one.partition("  #")[0].split()) for one in told]


COMMANDS = [(page, command) for page in PAGES for command in commands_of(page)]
OF_OTHERS = [each for each in COMMANDS if not each[1].startswith("springscale ")]


def of_beginning(command: str, table: dict[str, str]) -> str | None:
    """The table's answer for the first beginning that fits the command."""
    return next((said for beginning, said in table.items() if command.startswith(beginning)), None)


@pytest.mark.parametrize(("page", "command"), OF_OTHERS)
def test_every_command_has_a_test_or_a_reason_why_none_runs_it(page: str, command: str) -> None:
    if said := of_beginning(command, SAID):
        assert said in " ".join(text_of(page).split())
    elif runner := of_beginning(command, RUN_BY):
        assert (ROOT / runner).exists()
    else:
        assert of_beginning(command, NOT_RUN), f"neither run nor named as not run: {command}"


OUR_OWN = [
    (page, command)
    for page, command in COMMANDS
    if re.match("(springscale|python -m benchmarks.accuracy) [a-z]", command)
]


@pytest.mark.parametrize(("page", "command"), OUR_OWN)
def test_documented_options_of_our_commands_exist(page: str, command: str) -> None:
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


def test_every_row_of_the_tables_names_a_documented_command() -> None:
    told = [command for _, command in COMMANDS]
    lines = (*RUN_BY, *OWN_RUN_BY, *SAID, *NOT_RUN)
    assert [beginning for beginning in lines if not any(one.startswith(beginning) for one in told)] == []
