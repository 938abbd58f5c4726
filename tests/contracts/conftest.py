"""The web room over a store of the test's own, and a client that asks it."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from support.web import Client, Gateway


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[Gateway]:
    with Gateway(tmp_path) as opened:
        yield opened


@pytest.fixture
def client(gateway: Gateway) -> Client:
    return Client(gateway.app)
