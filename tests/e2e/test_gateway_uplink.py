"""The real service forwards what its store holds to a real broker, tells how it goes, and says goodbye."""

import json
import signal
from pathlib import Path

from support.broker import Listener, needs_mosquitto, running_broker
from support.configured import service_config
from support.estimates import make_record
from support.patience import PATIENCE_S, wait_until
from support.ports import first_answer, free_port
from support.process import running_service

from gateway.store import Store

pytestmark = needs_mosquitto


def configuration(folder: Path, web_port: int, broker_port: int) -> Path:
    uplink = {"uplink__host": "127.0.0.1", "uplink__port": broker_port, "uplink__tls": False}
    return service_config(folder, vehicle__id="van-17", web__port=web_port, **uplink)


def test_the_service_forwards_its_history_and_reports_progress(tmp_path: Path) -> None:
    records = [make_record(n) for n in range(3)]
    store = Store.open(tmp_path / "state")
    for record in records:
        store.write_estimate(record)
    store.close()
    web_port = free_port()
    with running_broker(tmp_path) as broker:
        listener = Listener(broker.port, "springscale/van-17/#")
        with running_service(configuration(tmp_path, web_port, broker.port)) as service:

            def uplink_now() -> dict[str, int]:
                return first_answer(f"http://127.0.0.1:{web_port}/api/v1/status").json()["uplink"]

            wait_until(lambda: uplink_now()["n_delivered"] == len(records))
            status = uplink_now()
            metrics = first_answer(f"http://127.0.0.1:{web_port}/metrics").text
            service.send_signal(signal.SIGTERM)
            _, errors = service.communicate(timeout=PATIENCE_S)
            assert service.returncode == 0, errors
        listener.wait_for(5)
        listener.close()
    assert status["n_delivered"] == len(records)
    assert status["is_connected"]
    assert "springscale_uplink_n_delivered 3.0" in metrics
    said = [json.loads(message.payload) for message in listener.heard]
    assert said[0]["state"] == "online"
    assert [one["id"] for one in said[1:4]] == [record["id"] for record in records]
    assert said[4] == {"state": "offline", "reason": "stopped"}
