"""Schemathesis asks what the description allows and what it forbids, and holds every answer to it.

With tokens on: it also checks that no route answers without one.
"""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, assume, given, settings
from schemathesis import GenerationMode
from schemathesis.schemas import APIOperation, BaseSchema
from support.alarms import LIMIT_KG, SUBJECT, of_load
from support.estimates import make_estimate
from support.patience import PATIENCE_S
from support.web import Gateway

from gateway.core.alarms.rules import AlarmRules
from gateway.records import Why
from gateway.service.alarm_reader import AlarmService
from gateway.web.access.tokens import Scope, TokenFile


@pytest.fixture(scope="module")
def token_file() -> Iterator[TokenFile]:
    with tempfile.TemporaryDirectory() as directory:
        tokens = TokenFile(Path(directory) / "tokens.json")
        tokens.create("somebody", Scope.READ)  # from the first token on they are asked for
        yield tokens


@pytest.fixture(scope="module")
def headers(token_file: TokenFile) -> dict[str, str]:
    return {"Authorization": f"Bearer {token_file.create('schemathesis', Scope.OPERATE)}"}


@pytest.fixture(scope="module")
def schema(token_file: TokenFile) -> Iterator[BaseSchema]:
    with tempfile.TemporaryDirectory() as directory, Gateway(Path(directory), tokens=token_file) as gateway:
        gateway.publish(*(make_estimate(n, *([Why.GAP] if n % 3 == 0 else []), with_spectra=True) for n in range(20)))
        AlarmService(AlarmRules(), SUBJECT, gateway.store)(of_load(0, LIMIT_KG + 60.0, n_batches=2))
        assert gateway.store.flush(PATIENCE_S)
        gateway.board.close()  # so that the stream has an end
        yield schemathesis.openapi.from_asgi("/openapi.json", gateway.app)


def operations(schema: BaseSchema) -> dict[str, APIOperation]:
    return {operation.label: operation for operation in (found.ok() for found in schema.get_all_operations())}


def described() -> dict[str, dict[str, Any]]:
    """Every operation that the application describes, by its label."""
    with tempfile.TemporaryDirectory() as directory, Gateway(Path(directory)) as gateway:
        paths = gateway.app.openapi()["paths"]
    return {f"{method.upper()} {path}": one for path, known in paths.items() for method, one in known.items()}


DESCRIBED = described()
WITH_PARAMETERS = [label for label, one in DESCRIBED.items() if one.get("parameters") or "requestBody" in one]


@pytest.mark.parametrize(
    ("label", "mode"),
    [(label, GenerationMode.POSITIVE) for label in DESCRIBED]
    + [(label, GenerationMode.NEGATIVE) for label in WITH_PARAMETERS],
)
def test_every_answer_is_as_described(
    schema: BaseSchema, headers: dict[str, str], label: str, mode: GenerationMode
) -> None:
    @settings(max_examples=12, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(case=operations(schema)[label].as_strategy(generation_mode=mode))
    def ask(case: schemathesis.Case) -> None:
        assume(all(value is not None and value not in ([], {}) for value in (case.query or {}).values()))  # never sent
        case.call_and_validate(headers=headers)

    ask()
