"""An alarm of the real service, from the bus to journal, API and webhook."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.patience import wait_until
from support.ports import first_answer, free_port
from support.process import ReplayedService
from support.receiver import SECRET_TEXT, Receiver, cut, status


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    with Receiver([status(500), cut]) as running:
        yield running


@pytest.fixture
def url() -> str:
    return f"http://127.0.0.1:{free_port()}"


@pytest.fixture
def service(tmp_path: Path, receiver: Receiver, url: str) -> Iterator[ReplayedService]:
    (tmp_path / "secret").write_text(SECRET_TEXT)
    keys = {"webhook__url": f"http://127.0.0.1:{receiver.port}/hook", "webhook__secret_file": "secret"}
    keys |= {"web__port": int(url.rpartition(":")[2]), "webhook__back_off_max_s": 0.1}
    with ReplayedService(tmp_path, vehicle__gross_limit_kg=1300.0, **keys) as running:
        yield running


def test_an_overload_on_the_bus_reaches_the_webhook(service: ReplayedService, receiver: Receiver, url: str) -> None:
    def told() -> dict[str, Any]:
        return receiver.taken[-1][1] if receiver.taken else {}

    assert wait_until(lambda: told().get("type") == "alarm")
    alarm = told()["data"]
    assert (alarm["vehicle_id"], alarm["kind"], alarm["where"]) == ("van-17", "overload", "gross")
    assert alarm["sentence"].startswith("The vehicle weighs 1412 +- ")
    assert first_answer(f"{url}/api/v1/alarms").json()["active"] == [alarm]
    now = first_answer(f"{url}/api/v1/status").json()
    assert now["alarms"]["active"] == ["overload.gross"]
    assert (now["webhook"]["n_failed"], now["webhook"]["n_dead"]) == (2, 0)
    assert service.stop() == 0
    assert receiver.wrong == []
    said = service.events()
    assert [one for one in said if one.startswith("alarm")] == ["alarm raised"]
    assert "webhook not taken" in said
