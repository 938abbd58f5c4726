"""A service without a calibration, for web tests that bring none of their own."""

from pathlib import Path
from typing import Any

from gateway.core.alarms.rules import AlarmRules
from gateway.service.alarm_reader import AlarmService
from gateway.setup import Subject
from gateway.store import Store
from support.learner import LearnerBench

NOBODY = Subject(None, "ratio_index", "van-17")


def of_no_vehicle(directory: Path, store: Store) -> dict[str, Any]:
    """The arguments of ``create_app``: services with nothing to weigh, and no alarm."""
    return {
        "alarms": AlarmService(AlarmRules(), NOBODY, store).standing,
        "learner": LearnerBench(directory / "learner").learner,
    }
