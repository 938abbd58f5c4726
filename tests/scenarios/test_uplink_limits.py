"""A record that the broker will never take holds up no other, in whichever way the broker says so."""

import json
from contextlib import closing
from pathlib import Path

import pytest
from support.estimates import make_record
from support.log import fields_of
from support.patience import wait_until
from support.sequence import BackEnd
from support.small_broker import Refusal, SmallBroker

from gateway.log import Event
from gateway.part import BackOff
from gateway.store import Store
from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import UplinkSettings
from gateway.uplink.uplink import Uplink

LARGE = (1, 4)


@pytest.mark.parametrize(
    ("refusal", "is_announced"), [("puback", False), ("disconnect", False), ("close", True), ("puback", True)]
)
def test_a_record_over_the_brokers_limit_is_counted_and_passed_over(
    tmp_path: Path, refusal: Refusal, is_announced: bool, caplog: pytest.LogCaptureFixture
) -> None:
    records = [make_record(n) | ({"ballast": "x" * 5000} if n in LARGE else {}) for n in range(6)]
    with closing(Store.open(tmp_path)) as store, SmallBroker(3000, refusal, is_announced=is_announced) as broker:
        for record in records:
            store.write_estimate(record)
        settings = UplinkSettings(
            host="127.0.0.1", port=broker.port, topic="springscale/van-17", client_id="van-17", tls=False
        )
        uplink = Uplink(settings, Outbox(store, "fleet"), {}, back_off=BackOff(0.001, 0.002))
        uplink.start()
        assert wait_until(lambda: uplink.report().n_delivered == len(records) - len(LARGE)), uplink.report()
        uplink.stop()
        assert uplink.report().n_refused == len(LARGE)
        assert broker.n_refused == (0 if is_announced else len(LARGE))
    assert [json.loads(text)["id"] for text in broker.estimates] == [
        record["id"] for n, record in enumerate(records) if n not in LARGE
    ]
    back_end = BackEnd()
    for text in broker.estimates:
        back_end.take(text)
    assert len(back_end.missing) == len(LARGE)
    assert fields_of(caplog, Event.UPLINK_REFUSED)["id"] == records[LARGE[-1]]["id"]
