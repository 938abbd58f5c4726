"""A vehicle has no package but those of requirements.txt: its commands work, the workbench's say what is missing.

Of these it imports neither plotly nor what plotly needs: its Debian package has one script of them.
"""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest
from make_deb import UNIMPORTED
from support.known_load_logs import write_known_loads
from support.locks import pins
from support.paper_van import paper_van_config
from support.patience import PATIENCE_S
from support.ports import first_answer, free_port

WITHOUT = """
import json, os, sys
for name in json.loads(os.environ["ABSENT"]):
    sys.modules[name] = None
from gateway.cli import main
main(sys.argv[1:])
"""
WINDOW = ("--window-s", "60")

Command = Callable[..., "subprocess.CompletedProcess[str]"]


def absent() -> list[str]:
    """Every importable package that a vehicle's lock file does not bring, or that nobody imports."""
    locked = {name.replace("-", "_") for name in pins("requirements.txt").keys() - UNIMPORTED} | {"springscale"}
    named = packages_distributions().items()
    return [
        package
        for package, owners in named
        if package != "gateway" and locked.isdisjoint(re.sub(r"[-_.]+", "_", owner).lower() for owner in owners)
    ]


@pytest.fixture(scope="module")
def environment() -> dict[str, str]:
    """The environment of a process that finds a vehicle's packages alone."""
    missing = absent()
    assert {"numba", "plotly", "matplotlib", "pandas", "pytest"} <= set(missing)
    return {**os.environ, "ABSENT": json.dumps(missing)}


@pytest.fixture(scope="module")
def vehicle(environment: dict[str, str]) -> Command:
    """The command line of a vehicle."""

    def run(*arguments: str | Path) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, "-c", WITHOUT, *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False, env=environment)

    return run


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Four drives with known loads."""
    return write_known_loads(tmp_path_factory.mktemp("campaign"), duration_s=130.0, identification_fraction=0.5)


@pytest.fixture(scope="module")
def calibrated(campaign: Path, vehicle: Command) -> Path:
    """The calibration file that `calibrate` makes with these packages."""
    output = campaign.parent / "vehicle.json"
    made = vehicle("calibrate", campaign, *WINDOW, "--output", output)
    assert made.returncode == 0, made.stderr
    return output


@pytest.fixture
def port() -> int:
    """The port of the service's web server."""
    return free_port()


@pytest.fixture
def config(tmp_path: Path, port: int) -> Path:
    """A configuration with the paper's van on a bus of the test's own."""
    return paper_van_config(tmp_path, port)


@pytest.mark.parametrize(
    ("arguments", "needs", "extra"),
    [
        (("demo", "--once"), "numba", "workbench"),
        (("simulate", "campaign", "experiment", "a"), "numba", "workbench"),
        (("reproduce",), "(matplotlib|numba)", "workbench"),
        (("reprocess",), "(distributed|obstore|polars)", "archive"),
    ],
    ids=lambda each: each[0] if isinstance(each, tuple) else "",
)
def test_a_command_that_needs_an_extra_names_it(
    vehicle: Command, arguments: tuple[str, ...], needs: str, extra: str
) -> None:
    asked = vehicle(*arguments)
    assert asked.returncode == 1
    said = rf"springscale: this command needs {needs}: pip install 'springscale\[{extra}\]'\n"
    assert re.fullmatch(said, asked.stderr)


def test_calibrated_drives_are_weighed_and_judged(campaign: Path, calibrated: Path, vehicle: Command) -> None:
    log, signals = campaign.parent / "01.log", campaign.parent / "signals.toml"
    weighed = vehicle("estimate", log, "--signals", signals, "--calibration", calibrated, *WINDOW)
    assert weighed.returncode == 0, weighed.stderr
    assert "payload" in weighed.stdout
    judged = vehicle("evaluate", campaign, "--calibration", calibrated, *WINDOW)
    assert judged.returncode == 0, judged.stderr
    assert "cross_spectrum" in judged.stdout


def test_a_report_names_the_extra(campaign: Path, vehicle: Command) -> None:
    asked = vehicle("calibrate", campaign, *WINDOW, "--output", campaign.parent / "b.json", "--report", "report")
    assert asked.returncode == 1
    assert asked.stderr.endswith("pip install 'springscale[workbench]'\n")


def test_a_log_is_replayed(campaign: Path, vehicle: Command) -> None:
    sent = vehicle("replay", campaign.parent / "01.log", "--interface", "virtual", "--channel", "a", "--speed", "max")
    assert sent.returncode == 0, sent.stderr
    assert "frames sent" in sent.stdout


def test_a_token_is_made_and_the_configuration_is_good(config: Path, vehicle: Command) -> None:
    assert vehicle("token", "create", "fleet", "--config", config).stdout.strip()
    checked = vehicle("check-config", config)
    assert checked.returncode == 0, checked.stderr


def test_the_service_runs_with_dashboard_and_api_pages(config: Path, port: int, environment: dict[str, str]) -> None:
    command = [sys.executable, "-c", WITHOUT, "run", "--config", str(config)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment) as service:
        try:
            site = f"http://127.0.0.1:{port}"
            assert "plotly" in first_answer(site).text
            assert first_answer(f"{site}/swagger/swagger-ui-bundle.js").is_success
        finally:
            service.send_signal(signal.SIGTERM)
            _, said = service.communicate(timeout=PATIENCE_S)
    assert service.returncode == 0, said
