"""Where a running service is re-zeroed: the one owner of its tare.json."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

from gateway.calibration.tare_file import FILE_NAME, TareEnd, TareEntry, TareHistory, entry_of, load_tares, save_tares
from gateway.core.calibrated import CalibratedVehicle
from gateway.core.flow import Flow
from gateway.core.tare import Refusal, Weighed, Zero, zero_of
from gateway.errors import ConfigurationError, TareRefusedError
from gateway.files.broken import BrokenFile
from gateway.log import Event, log_event, tell_event
from gateway.records import iso_utc, json_line

SERVICE = "service"  # who ended a tare where nobody asked for it

OnEvent = Callable[[str, Mapping[str, Any]], object]


class Weighing(Protocol):
    """The pipeline, as far as a tare needs it."""

    flow: Flow

    def weighed_age_s(self) -> float | None:
        """Seconds since ``flow.weighed`` was found; None where there is none."""
        ...


@dataclass(frozen=True, slots=True)
class Subject:
    """What is weighed, and with what."""

    calibrated: CalibratedVehicle | None
    estimator: str
    vehicle_id: str | None

    @property
    def calibration_id(self) -> str | None:
        """Of the calibration in use."""
        return None if self.calibrated is None else self.calibrated.id


class TareDesk:
    """Sets and undoes tares: on disk first, then in use, then answered. Thread-safe; a call may wait for the disk."""

    def __init__(
        self,
        directory: Path,
        subject: Subject,
        pipeline: Weighing,
        *,
        stale_after_s: float,
        on_event: OnEvent,
        clock_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        """Reads the history and puts the tare in use that is for this calibration; others end here.

        A file that cannot be believed is set aside: weighing goes on from the factory zero, and ``fault`` says so.
        """
        self._path = directory / FILE_NAME
        self._subject = subject
        self._pipeline = pipeline
        self._stale_after_s = stale_after_s
        self._on_event = on_event
        self._clock_ns = clock_ns
        self._lock = threading.Lock()
        self.fault: str | None = None
        self._broken = BrokenFile(self._path)
        self._history = self._believed()
        self._drop_others()
        self._use()

    def told(self) -> str:
        """JSON: the tare in use, what another would be made from now, and the history, newest first."""
        active = self._active()
        return json_line(
            {
                "active": None if active is None else active.model_dump(mode="json"),
                "offer": self._offer(),
                "history": [entry.model_dump(mode="json") for entry in reversed(self._history.entries)],
            }
        )

    def zeros(self) -> list[tuple[str, float]]:
        """Every tare of the calibration and estimator in use, ended or not, oldest first: when, and kg taken off."""
        own = (self._subject.calibration_id, self._subject.estimator)
        entries = self._history.entries
        return [(e.at, e.payload_kg) for e in entries if (e.calibration_id, e.estimator) == own]

    def tare(self, by: str, note: str | None) -> str:
        """Make the present weighing the zero -> the new entry as JSON. Raises TareRefusedError."""
        with self._lock:
            weighed, zero, calibration_id = self._found()
            entry = entry_of(
                weighed,
                zero,
                at_ns=self._clock_ns(),
                by=by,
                note=note,
                vehicle_id=self._subject.vehicle_id,
                calibration_id=calibration_id,
                estimator=self._subject.estimator,
            )
            self._keep(self._history.with_entry(entry))
            self.fault = None
            self._tell(Event.TARE_SET, {"tare_id": entry.id, "by": by, **asdict(zero)})
            return json_line(entry.model_dump(mode="json"))

    def undo(self, by: str, *, to_factory: bool) -> str:
        """Take the last tare out of use, or all -> what ``told`` says then. Raises TareRefusedError."""
        with self._lock:
            standing = self._standing()
            if not standing:
                raise TareRefusedError(Refusal.NOT_TARED, "there is no tare in use: this is the factory zero already")
            chosen = standing if to_factory else standing[-1:]
            end = TareEnd(at=iso_utc(self._clock_ns()), by=by, why="back_to_factory" if to_factory else "undone")
            self._keep(self._history.ended({entry.id for entry in chosen}, end))
            self._tell(Event.TARE_UNDONE, {"tare_ids": [entry.id for entry in chosen], "by": by})
            return self.told()

    def _believed(self) -> TareHistory:
        """What the file tells; nothing where it cannot be believed."""
        try:
            return load_tares(self._path)
        except ConfigurationError as fault:
            broken = str(fault)
        aside = self._broken.set_aside()
        self.fault = f"{self._path} cannot be believed: the factory zero is in use (it {aside})"
        self._tell(Event.TARE_SET_ASIDE, {"fault": broken, "set_aside": aside}, level=logging.ERROR)
        return TareHistory()

    def _active(self) -> TareEntry | None:
        return self._history.active(self._subject.calibration_id, self._subject.estimator)

    def _standing(self) -> list[TareEntry]:
        """Tares of this calibration and estimator that have not ended, the one in use last."""
        own = (self._subject.calibration_id, self._subject.estimator)
        entries = self._history.entries
        return [e for e in entries if e.ended is None and (e.calibration_id, e.estimator) == own]

    def _found(self) -> tuple[Weighed, Zero, str]:
        """What a tare made now would be. Raises TareRefusedError."""
        flow, calibrated = self._pipeline.flow, self._subject.calibrated
        weighed, age_s = flow.weighed, self._pipeline.weighed_age_s()
        if calibrated is None:
            raise TareRefusedError(Refusal.NO_CALIBRATION, "there is no calibration, and so nothing to correct")
        if weighed is None or age_s is None:
            raise TareRefusedError(
                Refusal.NO_COUNTED_BATCH,
                "no batch has counted since the service started: drive, empty, until one has",
            )
        if flow.load_may_have_changed:
            raise TareRefusedError(
                Refusal.LOAD_MAY_HAVE_CHANGED,
                "the vehicle has stopped and driven on since it was weighed: wait for the next batch that counts",
            )
        if age_s > self._stale_after_s:
            raise TareRefusedError(
                Refusal.STALE,
                f"it was weighed {age_s:.0f} s ago, a tare needs less than {self._stale_after_s:.0f} s: "
                "drive, empty, until the next batch has counted",
            )
        return weighed, zero_of(weighed, calibrated.vehicle), calibrated.id

    def _offer(self) -> dict[str, Any]:
        """What a tare would be made from now, or why there can be none."""
        try:
            weighed, zero, _ = self._found()
        except TareRefusedError as refusal:
            return {"is_possible": False, "reason": refusal.reason, "detail": str(refusal), "zero": None}
        found = {
            **asdict(zero),
            "n_batches": weighed.n_batches,
            "t_start": iso_utc(weighed.epoch.t_start_ns),
            "t_end": iso_utc(weighed.t_end_ns),
        }
        return {"is_possible": True, "reason": None, "detail": None, "zero": found}

    def _keep(self, history: TareHistory) -> None:
        """On disk, then in use. Raises TareRefusedError where the disk refuses; then nothing has changed."""
        try:
            self._broken.make_way()
            save_tares(self._path, history)
        except OSError as fault:
            raise TareRefusedError(
                Refusal.NOT_STORED, f"{self._path} cannot be written, so the zero stays as it was: {fault}"
            ) from None
        self._history = history
        self._use()

    def _tell(self, event: Event, fields: Mapping[str, Any], level: int = logging.INFO) -> None:
        """To the log, and to whoever keeps what happened."""
        tell_event(event, fields, self._on_event, level)

    def _use(self) -> None:
        active = self._active()
        self._pipeline.flow.tare = None if active is None else active.for_core()

    def _drop_others(self) -> None:
        """Tares of another calibration end: it has a zero of its own. The history keeps them."""
        calibration_id = self._subject.calibration_id
        if calibration_id is None:
            return
        others = {e.id for e in self._history.entries if e.ended is None and e.calibration_id != calibration_id}
        if not others:
            return
        end = TareEnd(at=iso_utc(self._clock_ns()), by=SERVICE, why="other_calibration")
        try:
            self._keep(self._history.ended(others, end))
        except TareRefusedError as refusal:  # they are not used in any case; the next start tries again
            log_event(Event.TARE_NOT_DROPPED, level=logging.WARNING, fault=str(refusal))
        self._tell(Event.TARE_DROPPED, {"tare_ids": sorted(others), "calibration_id": calibration_id})
