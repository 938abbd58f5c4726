"""What the web asks of a service without a calibration, where a test brings nothing of its own."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from gateway.core.alarms.rules import AlarmRules
from gateway.errors import RefusedError
from gateway.service.alarms import AlarmService
from gateway.service.verification.known_weights import KnownWeightService
from gateway.service.verification.verification import VerificationService
from gateway.setup import Subject
from gateway.stated.facts import Rule
from gateway.store import Store
from support.learner import LearnerBench

NOBODY = Subject(None, "ratio_index", "van-17")
COMMISSIONING = {"is_allowed": False, "why_not": "nobody can calibrate here", "is_offered": False, "is_pending": False}
NO_PIPELINE: Any = SimpleNamespace(flow=SimpleNamespace(knowledge=None, weighed=None), weighed_age_s=lambda: None)


class NoCommissioning:
    """Shows that there is nothing; every step is refused."""

    def state(self) -> str:
        return json.dumps({**COMMISSIONING, "underway": None, "active": None, "history": []})

    def lines(self) -> str:
        return '{"items":[]}'

    def __getattr__(self, step: str) -> Any:
        def refuse(*_: object, **__: object) -> str:
            raise RefusedError("not_allowed", "nobody can calibrate here")

        return refuse


def of_no_vehicle(directory: Path, store: Store) -> dict[str, Any]:
    """The arguments of ``create_app``: services with nothing to weigh; no alarm, and no commissioning is allowed."""
    reader = store.reader()
    return {
        "known_weights": KnownWeightService(
            directory, NOBODY, NO_PIPELINE, reader, stale_after_s=900.0, on_event=lambda kind, detail: None
        ),
        "verification": VerificationService(
            directory,
            NOBODY,
            reader,
            Rule(permitted_error_pct=5.0, permitted_axle_error_pct=None, loads=1),
            every_days=0.0,
            on_event=lambda kind, detail: None,
        ),
        "alarms": AlarmService(AlarmRules(), NOBODY, store).standing,
        "commissioning": NoCommissioning(),
        "learner": LearnerBench(directory / "learner").learner,
    }
