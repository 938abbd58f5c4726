"""Schemathesis asks what the description allows and what it forbids, and holds every answer to it.

With tokens on: it also checks that no route answers without one.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings
from schemathesis import GenerationMode
from schemathesis.schemas import APIOperation, BaseSchema
from schemathesis.specs.openapi.checks import positive_data_acceptance
from support.estimates import make_record
from support.web import Gateway

from gateway.records import Why
from gateway.web import Scope, TokenFile, WebSettings

PATHS = [
    "/api/v1/estimates/latest",
    "/api/v1/estimates",
    "/api/v1/status",
    "/api/v1/stream",
    "/api/v1/reasons",
    "/api/v1/vehicle",
    "/api/v1/spectra/latest",
    "/api/v1/export.csv",
    "/api/v1/export.jsonl",
    "/api/v1/weights/latest",
    "/api/v1/vss",
    "/rfms/vehicles",
    "/rfms/vehiclestatuses",
    "/health/live",
    "/health/ready",
    "/metrics",
]


PATIENT = WebSettings(n_wrong_tokens_per_min=1_000_000)  # schemathesis tries many


@pytest.fixture(scope="module")
def token_file() -> Iterator[TokenFile]:
    with tempfile.TemporaryDirectory() as directory:
        yield TokenFile(Path(directory) / "tokens.json")


@pytest.fixture(scope="module")
def headers(token_file: TokenFile) -> dict[str, str]:
    return {"Authorization": f"Bearer {token_file.create('schemathesis', Scope.READ)}"}


@pytest.fixture(scope="module")
def schema(token_file: TokenFile) -> Iterator[BaseSchema]:
    with tempfile.TemporaryDirectory() as directory, Gateway(Path(directory), PATIENT, token_file) as gateway:
        gateway.publish(*(make_record(n, *([Why.GAP] if n % 3 == 0 else []), with_spectra=True) for n in range(20)))
        assert gateway.store.flush(10.0)
        gateway.board.close()  # so that the stream has an end
        yield schemathesis.openapi.from_asgi("/openapi.json", gateway.app)


def operations(schema: BaseSchema) -> dict[str, APIOperation]:
    return {operation.path: operation for operation in (found.ok() for found in schema.get_all_operations())}


def test_no_path_escapes(schema: BaseSchema) -> None:
    assert set(operations(schema)) == set(PATHS)


# OpenAPI cannot say that two parameters exclude one another, as rFMS has it.
EXCLUDED = {"/rfms/vehiclestatuses": [positive_data_acceptance]}
WITHOUT_PARAMETERS = ("latest", "status", "reasons", "vehicle", "vss", "live", "ready", "metrics")
WITH_PARAMETERS = [path for path in PATHS if not path.endswith(WITHOUT_PARAMETERS)]


@pytest.mark.parametrize(
    ("path", "mode"),
    [(path, GenerationMode.POSITIVE) for path in PATHS] + [(path, GenerationMode.NEGATIVE) for path in WITH_PARAMETERS],
)
def test_every_answer_is_as_described(
    schema: BaseSchema, headers: dict[str, str], path: str, mode: GenerationMode
) -> None:
    @settings(max_examples=20, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(case=operations(schema)[path].as_strategy(generation_mode=mode))
    def ask(case: schemathesis.Case) -> None:
        case.call_and_validate(headers=headers, excluded_checks=EXCLUDED.get(path))

    ask()
