"""A vehicle as the service of known weights sees it, without a pipeline; and loads with every kind of error."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gateway.calibration.known_weights_file import FILE_NAME, KnownWeights, load_known_weights
from gateway.core.fusion import LoadEpoch, WeighedLoad, epoch_of
from gateway.core.known_weights import Knowledge, KnownWeightKind
from gateway.estimate import Estimate
from gateway.posterior import Posterior, Source
from gateway.records import iso_utc
from gateway.service.verification.known_weights import KnownWeightService
from gateway.setup import Subject
from gateway.stated.facts import StatedWeight
from gateway.store import Store
from gateway.units import NS_PER_S
from gateway.web.routes.known_weights import KnownWeightEntry, KnownWeightState
from support.calibrated import calibration_file
from support.epochs import START_NS, WINDOW_NS, stored

CALIBRATED = calibration_file().for_core()
BY = "ratio_index"
SUBJECT = Subject(CALIBRATED, BY, "van-17")
NOW_NS = START_NS + 3600 * NS_PER_S


def with_all_sources(payload_kg: float, share_pct: float = 50.0) -> Posterior:
    """A batch whose errors are as a van's are: what follows from the shape and the sensor grows with the load."""
    part = payload_kg / 300.0
    sources = {
        Source.CALIBRATION: [[9.0 + 6.0 * part, 0.10], [-4.0, 0.15]],
        Source.GOODS: [[22.0 * part, 0.12 * part]],
        Source.LOAD_LENGTH: [[22.0 * part, 0.12 * part]],
        Source.DAY: [[7.0, 0.05]],
        Source.SENSOR: [[3.0 * (1.0 + part), 0.02]],
        Source.EMPTY_SHARE: [[0.0, 0.4]],
        Source.MODEL: [[5.0, 0.0], [0.0, 0.1]],
    }
    columns = {name: np.array(rows) for name, rows in sources.items()}
    return Posterior(np.array([payload_kg, share_pct]), np.diag([7.0**2, 0.2**2]), columns)


class FakeFlow:
    """What the service sees of a flow."""

    def __init__(self) -> None:
        self.knowledge: Knowledge | None = None
        self.weighed: WeighedLoad | None = None
        self.load_may_have_changed = False


class FakePipeline:
    """A vehicle weighed a minute ago as 12 kg; the test may say otherwise."""

    def __init__(self) -> None:
        self.flow: Any = FakeFlow()
        self.age_s: float | None = 60.0
        self.n_weighed = 0
        self.weigh(12.0)

    def weigh(self, payload_kg: float, share_pct: float = 50.5, t_ns: int = NOW_NS) -> None:
        """Another load, of one batch."""
        self.n_weighed += 1
        epoch = LoadEpoch(t_ns - WINDOW_NS, (with_all_sources(payload_kg, share_pct),))
        self.flow.weighed = WeighedLoad(epoch, t_ns - WINDOW_NS, t_ns, (f"batch-{self.n_weighed}",))

    def weighed_age_s(self) -> float | None:
        return self.age_s

    def shown(self, payload_kg: float, t_ns: int = NOW_NS) -> Posterior:
        """What another load, measured as this, would leave as."""
        knowledge = self.flow.knowledge
        measured = with_all_sources(payload_kg)
        return measured if knowledge is None else knowledge.applied(measured, t_ns)


def load_of_two_batches(start_ns: int, payload_kg: float, **more: Any) -> list[Estimate]:
    """Two batches of one load, with every kind of error, as the flow would leave them."""
    posteriors = (with_all_sources(payload_kg - 2.0), with_all_sources(payload_kg + 2.0))
    found = []
    for n, posterior in enumerate(posteriors):
        together = LoadEpoch(start_ns, posteriors[: n + 1]).posterior
        blank = Estimate(start_ns + n * WINDOW_NS, start_ns + (n + 1) * WINDOW_NS, BY, CALIBRATED.id)
        found.append(replace(blank.answered(posterior), epoch=epoch_of(together, n + 1), **more))
    return found


class KnownWeightBench:
    """The service in a directory, over a store with loads an hour apart, each of two batches."""

    def __init__(self, directory: Path, *loads_kg: float, subject: Subject = SUBJECT) -> None:
        self.directory, self.subject = directory, subject
        drives = [load_of_two_batches(START_NS + i * 3600 * NS_PER_S, kg) for i, kg in enumerate(loads_kg)]
        self.store: Store = stored(directory / "store", *drives)
        self.now_ns = NOW_NS
        self.events: list[str] = []
        self.restart()

    def restart(self, **subject: Any) -> None:
        """As a new start of the service would."""
        self.pipeline = FakePipeline()
        self.service = KnownWeightService(
            self.directory,
            replace(self.subject, **subject),
            self.pipeline,
            self.store.reader(),
            stale_after_s=900.0,
            on_event=lambda kind, detail: self.events.append(kind),
            clock_ns=self._tick,
        )

    def _tick(self) -> int:
        self.now_ns += NS_PER_S
        return self.now_ns

    @property
    def kept(self) -> KnownWeights:
        """What is on disk."""
        return load_known_weights(self.directory / FILE_NAME)

    @property
    def in_use(self) -> str | None:
        knowledge = self.pipeline.flow.knowledge
        return None if knowledge is None else knowledge.id

    def empty(self) -> dict[str, Any]:
        """It is empty now."""
        return self._entry(self.service.add(KnownWeightKind.EMPTY, "workshop", None))

    def ticket(self, i: int, payload_kg: float, **stated: Any) -> dict[str, Any]:
        """A payload that is known of the i-th load of the store."""
        return self._entry(
            self.service.add(KnownWeightKind.TICKET, "workshop", None, self.stated(i, payload_kg, **stated))
        )

    @staticmethod
    def stated(i: int, payload_kg: float, **stated: Any) -> StatedWeight:
        at_ns = START_NS + i * 3600 * NS_PER_S + WINDOW_NS
        return StatedWeight(**{"at": iso_utc(at_ns), "payload_kg": payload_kg, **stated})

    def state(self) -> dict[str, Any]:
        text = self.service.state()
        KnownWeightState.model_validate_json(text)  # the shape that the API promises
        return json.loads(text)

    @staticmethod
    def _entry(text: str) -> dict[str, Any]:
        KnownWeightEntry.model_validate_json(text)
        return json.loads(text)
