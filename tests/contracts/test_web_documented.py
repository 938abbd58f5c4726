"""docs/api.md lists the routes that there are."""

import re
from pathlib import Path
from typing import Any

import pytest
from support.web import Client, Gateway

from gateway.estimates.as_json import COLUMNS
from gateway.web.schemas import Estimate, WeightFigures

API = (Path(__file__).parents[2] / "docs" / "api.md").read_text()


@pytest.fixture(scope="module")
def description(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    with Gateway(tmp_path_factory.mktemp("store")) as gateway:
        return Client(gateway.app).get("/openapi.json").json()


@pytest.fixture
def history(description: dict[str, Any]) -> dict[str, Any]:
    return description["paths"]["/api/v1/estimates"]["get"]


@pytest.fixture
def row() -> str:
    """The history's, in the table of routes."""
    (row,) = [line for line in API.splitlines() if line.startswith("| `/api/v1/estimates` ")]
    return row


def test_every_route_is_in_the_table_and_no_other(description: dict[str, Any]) -> None:
    assert set(re.findall(r"^\| `(/\S+)` \|", API, re.MULTILINE)) == set(description["paths"])


def test_every_parameter_of_the_history_is_named(history: dict[str, Any], row: str) -> None:
    assert {f"`{parameter['name']}`" for parameter in history["parameters"]} <= set(re.findall(r"`\w+`", row))


def test_the_columns_of_the_export_are_fields_of_an_estimate() -> None:
    fields = set(Estimate.model_fields)
    bounds = {name.replace("low95", "interval95").replace("high95", "interval95") for name in COLUMNS}
    places = set(WeightFigures.model_fields)
    weights = {f"{place}_{unit}" for place in places for unit in ("kg", "std_kg", "limit_kg")}
    assert weights <= set(COLUMNS)
    assert bounds - weights - {"over_limit"} <= fields
    assert "weights" in fields


def test_every_order_of_the_history_is_named_with_its_meaning(history: dict[str, Any], row: str) -> None:
    (order,) = [one for one in history["parameters"] if one["name"] == "order"]
    for value in order["schema"]["enum"]:
        assert f"`{value}`" in row
        assert value in order["description"]


def test_the_fields_of_a_load_epoch_are_described(description: dict[str, Any]) -> None:
    """The fields epoch_* were once in no schema."""
    fields = description["components"]["schemas"]["Estimate"]["properties"]
    described = {name: one for name, one in fields.items() if name.startswith("epoch_")}
    figures = {f"epoch_{name}" for name in ("payload_kg", "payload_std_kg", "front_share_pct", "front_share_std_pct")}
    assert figures | {"epoch_n_batches"} <= set(described)
    assert all(one.get("description") for one in described.values())
