"""Schemathesis asks what the description allows and what it forbids, and holds every answer to it."""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from schemathesis import GenerationMode
from schemathesis.schemas import APIOperation, BaseSchema
from support.estimates import make_record
from support.web import Gateway

from gateway.records import Why

PATHS = [
    "/api/v1/estimates/latest",
    "/api/v1/estimates",
    "/api/v1/status",
    "/api/v1/stream",
    "/api/v1/vehicle",
    "/api/v1/spectra/latest",
    "/api/v1/export.csv",
    "/api/v1/export.jsonl",
    "/health/live",
    "/health/ready",
    "/metrics",
]


@pytest.fixture(scope="module")
def schema() -> Iterator[BaseSchema]:
    with tempfile.TemporaryDirectory() as directory, Gateway(Path(directory)) as gateway:
        gateway.publish(*(make_record(n, *([Why.GAP] if n % 3 == 0 else []), with_spectra=True) for n in range(20)))
        assert gateway.store.flush(10.0)
        gateway.board.close()  # so that the stream has an end
        yield schemathesis.openapi.from_asgi("/openapi.json", gateway.app)


def operations(schema: BaseSchema) -> dict[str, APIOperation]:
    return {operation.path: operation for operation in (found.ok() for found in schema.get_all_operations())}


def test_no_path_escapes(schema: BaseSchema) -> None:
    assert set(operations(schema)) == set(PATHS)


WITH_PARAMETERS = [
    path for path in PATHS if path.split("/")[-1] in ("estimates", "stream", "export.csv", "export.jsonl")
]


@pytest.mark.parametrize(
    ("path", "mode"),
    [(path, GenerationMode.POSITIVE) for path in PATHS] + [(path, GenerationMode.NEGATIVE) for path in WITH_PARAMETERS],
)
def test_every_answer_is_as_described(schema: BaseSchema, path: str, mode: GenerationMode) -> None:
    @settings(max_examples=20, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(case=operations(schema)[path].as_strategy(generation_mode=mode))
    def ask(case: schemathesis.Case) -> None:
        case.call_and_validate()

    ask()
