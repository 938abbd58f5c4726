"""Logs that cannot be read, were cut away or stand for two runs: each is told before any row is looked at."""

from dataclasses import replace

import pytest
from support.half_car_road import VAN

from gateway.calibration.inspection.campaign import inspect_campaign
from gateway.calibration.inspection.finding import Kind
from gateway.calibration.inspection.log import LogFacts, SplitRun, log_findings, same_drive_findings
from gateway.calibration.inspection.rows import RowFacts
from gateway.calibration.known_run import KnownRun
from gateway.core.settings import BatchSettings

SOUND = LogFacts("a" * 64, 900.0, 0.0, (0, 900))
EMPTY, LOADED = (0.0, 50.0), (420.0, 58.0)


@pytest.mark.parametrize(
    ("facts", "kinds"),
    [
        (SOUND, []),
        (LogFacts(unreadable="a.log: holds no CAN frame"), [Kind.LOG_UNREADABLE]),
        (replace(SOUND, start_s=2000.0, span_ns=None), [Kind.CUT_AWAY]),
        (replace(SOUND, damage="the log ends early: the file is cut off"), [Kind.LOG_DAMAGED]),
    ],
)
def test_how_a_log_was_read_is_told(facts: LogFacts, kinds: list[Kind]) -> None:
    assert [finding.kind for finding in log_findings(facts)] == kinds


def test_a_piece_beyond_the_end_says_where_the_log_ends() -> None:
    (finding,) = log_findings(replace(SOUND, start_s=2000.0, span_ns=None))
    assert finding.text == "the log lasts 900 s, and the run begins at 2000 s"


@pytest.mark.parametrize(
    ("other", "load", "numbers"),
    [
        (SOUND, EMPTY, [2]),  # tells nothing new
        (SOUND, LOADED, [1, 2]),  # one of the loads is wrong, and nobody knows which
        (replace(SOUND, span_ns=(600, 1500)), LOADED, [1, 2]),
        (replace(SOUND, span_ns=(900, 1800)), LOADED, []),  # the next piece of the same log
        (replace(SOUND, sha256="b" * 64), LOADED, []),
        (LogFacts(unreadable="gone"), LOADED, []),
    ],
)
def test_two_runs_on_one_drive_are_found(other: LogFacts, load: tuple[float, float], numbers: list[int]) -> None:
    runs = [KnownRun(1, "a.log", *EMPTY, ()), KnownRun(2, "b.log", *load, ())]
    told = list(
        same_drive_findings([SplitRun(run, run, log=log) for run, log in zip(runs, (SOUND, other), strict=True)])
    )
    assert [number for number, _ in told] == numbers
    assert all("runs 1 and 2" in finding.text for _, finding in told)


def test_a_run_without_a_readable_log_is_told_once_and_a_load_far_beyond_the_range_is_doubted() -> None:
    nothing = KnownRun(1, "a.log", 4200.0, 60.0, ())
    unreadable = SplitRun(nothing, nothing, RowFacts(), log=LogFacts(unreadable="a.log: holds no CAN frame"))
    ((verdict,), _) = inspect_campaign([unreadable], VAN, BatchSettings())
    assert [finding.kind for finding in verdict.findings] == [Kind.LOG_UNREADABLE, Kind.LOAD_BEYOND_RANGE]
    assert not verdict.is_usable
