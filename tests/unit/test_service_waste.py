"""What a small box must not spend again and again: the status in the event loop, old estimates weighed anew."""

import asyncio
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from support.estimates import make_estimate
from support.paper_van import paper_van_config
from support.ports import free_port

from gateway.config import load_settings
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.vehicle import Vehicle
from gateway.estimate import Estimate, Quantity, Weights
from gateway.service.gateway import Gateway
from gateway.service.status import StatusReport
from gateway.setup import setup_of
from gateway.status import Status
from gateway.web.live.board import Board
from gateway.web.routes.weights import Scales, weigh_latest

VAN = Vehicle(
    name="van",
    empty_mass_kg=1240.0,
    wheelbase_m=2.8,
    sensor_position_m=0.0,
    unsprung_front_kg=90.0,
    unsprung_rear_kg=110.0,
    gross_limit_kg=1500.0,
)


def test_each_estimate_is_weighed_once_however_often_the_weights_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each call weighed the last hundred anew."""
    board, scales = Board(), Scales(CalibratedVehicle("sha256:ab", VAN, (0.0, 420.0), (40.0, 60.0)))
    n_weighed = 0
    weigh = Scales.weigh

    def counted(self: Scales, estimate: Estimate | None) -> Weights:
        nonlocal n_weighed
        n_weighed += 1
        return weigh(self, estimate)

    monkeypatch.setattr(Scales, "weigh", counted)
    for n in range(150):
        board.publish(replace(make_estimate(n), payload=Quantity(100.0 + n, 6.0), front_share=Quantity(50.0, 0.5)))
        for _ in range(3):
            shown = weigh_latest(board, scales)
    assert n_weighed == 150
    assert shown.gross.kg == 1240.0 + 200.0 + 249.0
    assert shown.gross.is_over_limit


def test_the_whole_status_is_made_beside_the_event_loop_and_once_a_second(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was made four times a second, in the event loop."""
    settings = load_settings(paper_van_config(tmp_path, free_port()))
    made_by: list[int] = []
    make = StatusReport.__call__

    def noted(self: StatusReport) -> Status:
        made_by.append(threading.get_ident())
        return make(self)

    def on_started(gateway: Gateway) -> None:
        made_by.clear()
        monkeypatch.setattr(StatusReport, "__call__", noted)
        asyncio.get_running_loop().call_later(2.5, gateway.request_stop)

    Gateway(settings, setup_of(settings), on_started=on_started).run()
    assert 1 <= len(made_by) <= 3
    assert threading.get_ident() not in made_by
