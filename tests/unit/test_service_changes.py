"""The service's log has a line for each change, and none while all stays as it is."""

import pytest
from support.estimates import make_estimate
from support.log import logged, names

from gateway.estimates.batch_estimate import Estimate
from gateway.log import Event
from gateway.records import Why
from gateway.service.batch_log import BatchLog, StateLog
from gateway.status import State, Status
from gateway.web.live.board import Board


class Told:
    """A board and the log of what is put on it, as in the pipeline."""

    def __init__(self) -> None:
        self.clock_s = 0.0
        self.board = Board(stale_after_s=900.0, clock=lambda: self.clock_s)
        self.log = BatchLog()

    def hear(self, *estimates: Estimate) -> None:
        for estimate in estimates:
            self.board.publish(estimate)
            self.log(estimate)


@pytest.fixture(autouse=True)
def _at_info(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "gateway")


def test_an_estimate_is_a_line_with_its_numbers(caplog: pytest.LogCaptureFixture) -> None:
    found = make_estimate(3)
    Told().hear(found)
    assert logged(caplog) == [
        (
            Event.ESTIMATE,
            {"batch": found.id, "payload_kg": 103.0, "payload_std_kg": 6.0, "front_share_pct": 50.5, "rejected": ()},
        )
    ]


def test_reasons_are_logged_when_their_set_changes(caplog: pytest.LogCaptureFixture) -> None:
    told = Told()
    told.hear(
        make_estimate(0, Why.TOO_SLOW, Why.GAP),
        make_estimate(1, Why.GAP, Why.TOO_SLOW),
        make_estimate(2, Why.GAP),
        make_estimate(3, Why.GAP),
        make_estimate(4),
        make_estimate(5),
    )
    changes = [fields for event, fields in logged(caplog) if event is Event.REASONS_CHANGED]
    assert changes == [
        {"rejected": (Why.TOO_SLOW, Why.GAP), "before": []},
        {"rejected": (Why.GAP,), "before": [Why.GAP, Why.TOO_SLOW]},
        {"rejected": (), "before": [Why.GAP]},
    ]
    assert names(caplog).count(Event.ESTIMATE) == 2
    assert Event.REJECTED not in names(caplog)


def test_debug_level_logs_every_batch(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("DEBUG", "gateway")
    Told().hear(make_estimate(0, Why.GAP))
    assert names(caplog) == [Event.REJECTED, Event.REASONS_CHANGED]
    assert dict(logged(caplog))[Event.REJECTED]["payload_kg"] is None


def test_the_state_and_an_old_estimate_are_lines_when_they_change(caplog: pytest.LogCaptureFixture) -> None:
    told = Told()
    log = StateLog(told.board)
    now = Status(version="1", state=State.COLLECTING, uptime_s=1.0, calibration_id="sha256:ab")
    driving = now.model_copy(update={"state": State.ESTIMATING})
    for status in (now, now, driving, driving):
        log(status)
    assert [fields["state"] for _, fields in logged(caplog)] == [State.COLLECTING, State.ESTIMATING]
    assert logged(caplog)[1][1]["before"] is State.COLLECTING

    told.hear(make_estimate(0))
    caplog.clear()
    for told.clock_s in (899.0, 901.0, 950.0):
        log(driving)
    assert logged(caplog) == [(Event.STALE, {"age_s": 901.0})]
    told.hear(make_estimate(1))
    log(driving)
    log(driving)
    assert names(caplog) == [Event.STALE, Event.ESTIMATE, Event.FRESH]
