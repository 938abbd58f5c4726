"""A real Prometheus scrapes the real service after the demonstration's drive and evaluates every shipped rule.

Runs where `prometheus`, `promtool` and mosquitto are found (support.parts). The service has uplink, webhook and limits,
which rules ask about.
"""

import json
import subprocess
import sys
import urllib.parse
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml
from support.broker import needs_mosquitto, running_broker
from support.parts import found, needs
from support.patience import PATIENCE_S, wait_until
from support.ports import first_answer, free_port
from support.receiver import SECRET_TEXT, Receiver

from gateway.bus.logs import write_candump
from gateway.workbench.simulated_drives import demo_drive, frames_of

ROOT = Path(__file__).parents[2]
RULES = ROOT / "deploy/prometheus/springscale.rules.yml"
HEAVY_SEED = 2  # the demonstration's second drive carries 400 kg, too much for the limits below

pytestmark = [needs("prometheus"), needs("promtool"), needs_mosquitto]


@dataclass(frozen=True, slots=True)
class Scraped:
    """A Prometheus that has scraped the service for a while."""

    url: str
    instance: str

    def asked(self, path: str, **query: str) -> Any:
        with urllib.request.urlopen(
            f"{self.url}/api/v1/{path}?{urllib.parse.urlencode(query)}", timeout=10.0
        ) as answer:
            told = json.load(answer)
        assert told["status"] == "success"
        return told["data"]

    def values(self, expression: str) -> list[Any]:
        """The present values of a query for this instance."""
        return self.asked("query", query=expression.replace("$instance", self.instance))["result"]


@pytest.fixture(scope="module")
def scraped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scraped]:
    folder = tmp_path_factory.mktemp("scraped")
    log, web_port, port = folder / "drive.log", free_port(), free_port()
    write_candump(frames_of(demo_drive(HEAVY_SEED)), "can0", log)
    with running_broker(folder) as broker, Receiver() as receiver:
        config = _config(folder, web_port, broker.port, receiver)
        command = [sys.executable, "-m", "support.replayed_service", str(config), str(log), "later"]
        service = subprocess.Popen(command, stdin=subprocess.PIPE, cwd=ROOT / "tests", stderr=subprocess.DEVNULL)
        assert service.stdin is not None
        first_answer(f"http://127.0.0.1:{web_port}/health/live")
        prometheus = _prometheus(folder, port, web_port)
        here = Scraped(f"http://127.0.0.1:{port}", f"127.0.0.1:{web_port}")
        try:
            assert wait_until(lambda: _answers(here.url))
            assert wait_until(lambda: bool(here.values("springscale_bus_n_frames")))
            service.stdin.write(b"\n")  # now it drives
            service.stdin.flush()
            assert wait_until(lambda: bool(here.values('springscale_estimate_payload_kg{instance="$instance"}')))
            yield here
        finally:
            prometheus.terminate()
            prometheus.wait(PATIENCE_S)
            service.stdin.close()
            service.wait(PATIENCE_S)


def _config(folder: Path, web_port: int, broker_port: int, receiver: Receiver) -> Path:
    secret = folder / "secret"
    secret.write_text(SECRET_TEXT)
    secret.chmod(0o600)
    path = folder / "springscale.toml"
    path.write_text(
        f"""
        signals = "springscale:reference"
        calibration = "{ROOT / "gateway/demo/paper_van.json"}"
        [vehicle]
        id = "demo-van"
        gross_limit_kg = 1750.0
        front_axle_limit_kg = 900.0
        rear_axle_limit_kg = 950.0
        [bus]
        interface = "virtual"
        channel = "{folder.name}"
        [web]
        port = {web_port}
        [store]
        directory = "state"
        [uplink]
        host = "127.0.0.1"
        port = {broker_port}
        tls = false
        [webhook]
        url = "http://127.0.0.1:{receiver.port}/hook"
        secret_file = "{secret}"
        send = ["alarms", "events", "estimates"]
        """
    )
    return path


def _prometheus(folder: Path, port: int, web_port: int) -> "subprocess.Popen[bytes]":
    (folder / "prometheus.yml").write_text(
        yaml.safe_dump(
            {
                "global": {"scrape_interval": "1s", "evaluation_interval": "1s"},
                "rule_files": [str(RULES)],
                "scrape_configs": [
                    {"job_name": "springscale", "static_configs": [{"targets": [f"127.0.0.1:{web_port}"]}]}
                ],
            }
        )
    )
    program = found("prometheus")
    assert program is not None
    command = [program, f"--config.file={folder}/prometheus.yml", f"--storage.tsdb.path={folder}/data"]
    with (folder / "prometheus.log").open("wb") as log:
        return subprocess.Popen([*command, f"--web.listen-address=127.0.0.1:{port}"], stderr=log)


def _answers(url: str) -> bool:
    try:
        urllib.request.urlopen(f"{url}/-/ready", timeout=2.0).close()
    except OSError:
        return False
    return True


def test_promtool_finds_nothing_wrong_with_the_rules() -> None:
    program = found("promtool")
    assert program is not None
    checked = subprocess.run([program, "check", "rules", str(RULES)], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_the_service_is_a_target_that_is_up(scraped: Scraped) -> None:
    def seen() -> list[tuple[str, str]]:
        return [(target["health"], target["lastError"]) for target in scraped.asked("targets")["activeTargets"]]

    assert wait_until(lambda: seen() == [("up", "")]), seen()  # a busy machine may miss a scrape


def test_every_rule_is_loaded_and_evaluated_without_an_error(scraped: Scraped) -> None:
    def rules() -> list[dict[str, Any]]:
        return [rule for group in scraped.asked("rules")["groups"] for rule in group["rules"]]

    assert wait_until(lambda: {rule["health"] for rule in rules()} == {"ok"}), rules()
    written = yaml.safe_load(RULES.read_text())["groups"][0]["rules"]
    assert {rule["name"] for rule in rules()} >= {rule["alert"] for rule in written}
