"""A verification desk over a store, without a service around it."""

from collections.abc import Callable
from pathlib import Path

from gateway.service.verification.verification import VerificationService
from gateway.setup import Subject
from gateway.stated.facts import Rule
from gateway.store import Store
from support.calibrated import calibration_file
from support.epochs import START_NS

CALIBRATED = calibration_file().for_core()
RULE = Rule(permitted_error_pct=5.0, permitted_axle_error_pct=None, loads=1)


def verification_desk(
    directory: Path,
    store: Store,
    rule: Rule = RULE,
    *,
    every_days: float = 0.0,
    clock_ns: Callable[[], int] = lambda: START_NS,
) -> VerificationService:
    """It tells nobody."""
    return VerificationService(
        directory,
        Subject(CALIBRATED, "ratio_index", "van-17"),
        store.reader(),
        rule,
        every_days=every_days,
        on_event=lambda kind, detail: None,
        clock_ns=clock_ns,
    )
