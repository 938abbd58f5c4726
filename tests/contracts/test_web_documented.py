"""docs/api.md lists the routes that there are."""

import re
from pathlib import Path

from support.web import Client, Gateway

from gateway.estimate_json import COLUMNS
from gateway.web.schemas import Estimate, WeightFigures

API = (Path(__file__).parents[2] / "docs" / "api.md").read_text()


def test_every_route_is_in_the_table_and_no_other(tmp_path: Path) -> None:
    with Gateway(tmp_path) as gateway:
        described = Client(gateway.app).get("/openapi.json").json()["paths"]
    assert set(re.findall(r"^\| `(/\S+)` \|", API, re.MULTILINE)) == set(described)


def test_every_parameter_of_the_history_is_named(tmp_path: Path) -> None:
    with Gateway(tmp_path) as gateway:
        history = Client(gateway.app).get("/openapi.json").json()["paths"]["/api/v1/estimates"]["get"]
    (row,) = [line for line in API.splitlines() if line.startswith("| `/api/v1/estimates` ")]
    assert {f"`{parameter['name']}`" for parameter in history["parameters"]} <= set(re.findall(r"`\w+`", row))


def test_the_columns_of_the_export_are_fields_of_an_estimate() -> None:
    fields = set(Estimate.model_fields)
    bounds = {name.replace("low95", "interval95").replace("high95", "interval95") for name in COLUMNS}
    places = set(WeightFigures.model_fields)
    weights = {f"{place}_{unit}" for place in places for unit in ("kg", "std_kg", "limit_kg")}
    assert weights <= set(COLUMNS)
    assert bounds - weights - {"over_limit"} <= fields
    assert "weights" in fields


def test_every_order_of_the_history_is_named_with_its_meaning(tmp_path: Path) -> None:
    with Gateway(tmp_path) as gateway:
        history = Client(gateway.app).get("/openapi.json").json()["paths"]["/api/v1/estimates"]["get"]
    (order,) = [one for one in history["parameters"] if one["name"] == "order"]
    (row,) = [line for line in API.splitlines() if line.startswith("| `/api/v1/estimates` ")]
    for value in order["schema"]["enum"]:
        assert f"`{value}`" in row
        assert value in order["description"]


def test_what_a_load_epoch_tells_is_described(tmp_path: Path) -> None:
    """The fields epoch_* were once in no schema."""
    with Gateway(tmp_path) as gateway:
        shapes = Client(gateway.app).get("/openapi.json").json()["components"]["schemas"]
    described = {name: one for name, one in shapes["Estimate"]["properties"].items() if name.startswith("epoch_")}
    figures = {f"epoch_{name}" for name in ("payload_kg", "payload_std_kg", "front_share_pct", "front_share_std_pct")}
    assert figures | {"epoch_n_batches"} <= set(described)
    assert all(one.get("description") for one in described.values())


def test_a_summary_is_a_sentence_and_no_function_s_name(tmp_path: Path) -> None:
    with Gateway(tmp_path) as gateway:
        paths = Client(gateway.app).get("/openapi.json").json()["paths"]
    summaries = [operation["summary"] for path in paths.values() for operation in path.values()]
    assert [one for one in summaries if len(one.split()) < 3 or one == one.title()] == []
