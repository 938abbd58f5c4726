"""The alert rules speak PromQL, and only of metrics and labels that /metrics has."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import promql_parser
import pytest
import yaml
from prometheus_client.parser import text_string_to_metric_families
from support.estimates import make_estimate
from support.paper_van import paper_van
from support.web import Client, Gateway

from gateway.estimates.batch_estimate import Quantity
from gateway.status import (
    AlarmsStatus,
    BatchCounts,
    BusStatus,
    DecodeCount,
    RecordStatus,
    SignalHealth,
    State,
    StatementsHeard,
    Status,
    UplinkStatus,
    WebhookStatus,
)
from gateway.weighing.calibrated import CalibratedVehicle

DEPLOY = Path(__file__).parents[2] / "deploy"
RULES = [
    rule
    for group in yaml.safe_load((DEPLOY / "prometheus" / "springscale.rules.yml").read_text())["groups"]
    for rule in group["rules"]
]
VAN = paper_van(unsprung_front_kg=90.0, unsprung_rear_kg=110.0, gross_limit_kg=1900.0, front_axle_limit_kg=900.0)
BY_PROMETHEUS = {"up"}
LABELS_BY_PROMETHEUS = {"instance", "job"}


@pytest.fixture(scope="module")
def exposed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, set[str]]]:
    """Label values by label, by name of a sample, of a service that has seen everything once."""
    calibrated = CalibratedVehicle("sha256:ab", VAN, (0.0, 420.0), (40.0, 60.0))
    with Gateway(tmp_path_factory.mktemp("store"), calibrated=calibrated) as gateway:
        gateway.status = Status(
            version="1.2.3",
            state=State.ESTIMATING,
            uptime_s=60.0,
            bus=BusStatus(n_kernel_dropped=0, last_frame_age_s=0.1),
            decode=(DecodeCount(signal="speed", reason="ok", n=7),),
            signals=(SignalHealth(signal="speed", rate_hz=5.0, last_age_s=0.1, rejected_share=0.0),),
            batches=BatchCounts(n_estimates=1, n_rejected=2, rejected_by_reason={"gap": 2}),
            uplink=UplinkStatus("fleet.example:8883", waiting_age_s=7.0, statements=StatementsHeard()),
            webhook=WebhookStatus(receiver="https://fleet.example:443", waiting_age_s=7.0),
            record=RecordStatus(n_frames_written=7),
            alarms=AlarmsStatus(("overload.gross",), watched=("overload.gross", "sensor_fault.silent")),
        )
        gateway.publish(replace(make_estimate(0), front_share=Quantity(50.5, 0.5)))
        client = Client(gateway.app)
        client.get("/health/live")
        text = client.get("/metrics").text
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


def test_names_follow_the_conventions(exposed: dict[str, dict[str, set[str]]]) -> None:
    for name in exposed:
        assert re.fullmatch(r"springscale_[a-z0-9_]+", name)
        assert not re.search(r"_(kg|ms|pct|percent|count|hz)(_|$)", name), name
