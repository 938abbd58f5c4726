"""The alert rules speak PromQL, and only of metrics and labels that /metrics has."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import promql_parser
import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families
from support.web import Client, Gateway

from gateway.status import (
    AlarmsStatus,
    BusStatus,
    RecordStatus,
    SignalHealth,
    State,
    Status,
    StoreState,
    StoreStatus,
    UplinkStatus,
    WebhookStatus,
)

DEPLOY = Path(__file__).parents[2] / "deploy"
RULES = [
    rule
    for group in yaml.safe_load((DEPLOY / "prometheus" / "springscale.rules.yml").read_text())["groups"]
    for rule in group["rules"]
]
BY_PROMETHEUS = {"up"}
LABELS_BY_PROMETHEUS = {"instance", "job"}


def metrics_of(gateway: Gateway, state: State) -> str:
    gateway.status = Status(
        version="1.2.3",
        state=state,
        uptime_s=60.0,
        bus=BusStatus(n_kernel_dropped=0, last_frame_age_s=0.1),
        signals=(SignalHealth(signal="speed", last_age_s=0.1),),
        store=StoreStatus(StoreState.DEGRADED),
        uplink=UplinkStatus("fleet.example:8883", waiting_age_s=7.0),
        webhook=WebhookStatus(receiver="https://fleet.example:443", waiting_age_s=7.0),
        record=RecordStatus(last_fault="the disk refuses"),
        alarms=AlarmsStatus(("overload.gross",)),
    )
    return Client(gateway.app).get("/metrics").text


@pytest.fixture(scope="module")
def exposed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, set[str]]]:
    """Label values by label, by name of a sample, of a service that has seen everything once."""
    with Gateway(tmp_path_factory.mktemp("store")) as gateway:
        text = "".join(metrics_of(gateway, state) for state in State)
    found: dict[str, dict[str, set[str]]] = {}
    for family in text_string_to_metric_families(text):
        for sample in family.samples:
            labels = found.setdefault(sample.name, {})
            for label, content in sample.labels.items():
                labels.setdefault(label, set()).add(content)
    return found


def selectors(expression: str) -> Iterator[Any]:
    """Every vector selector of a PromQL expression."""
    found: list[Any] = []

    def note(node: Any) -> bool:
        if isinstance(node, promql_parser.VectorSelector):
            found.append(node)
        return True

    promql_parser.walk(promql_parser.parse(expression), note)
    assert found
    return iter(found)


def assert_exposed(expression: str, exposed: dict[str, dict[str, set[str]]]) -> None:
    for selector in selectors(expression):
        if selector.name in BY_PROMETHEUS:
            continue
        assert selector.name in exposed, selector.name
        for matcher in selector.matchers.matchers:
            if matcher.name in LABELS_BY_PROMETHEUS:
                continue
            known = exposed[selector.name].get(matcher.name, set())
            assert known, f"{selector.name} has no label {matcher.name}"
            assert any(re.fullmatch(wanted, k) for wanted in matcher.value.split("|") for k in known), matcher.value


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule["alert"])
def test_an_alert_can_fire_and_says_what_to_do(rule: dict[str, Any], exposed: dict[str, dict[str, set[str]]]) -> None:
    assert_exposed(rule["expr"], exposed)
    assert rule["labels"]["severity"] in ("warning", "critical")
    assert {"summary", "description"} == set(rule["annotations"])
    if "for" in rule:
        promql_parser.parse_duration(rule["for"])
