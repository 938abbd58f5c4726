"""What is learnt so far, as the web asks for it: the state, the questions, and the versions to choose from."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Final

from gateway.calibration.assigned import Piece
from gateway.calibration.learning.job import LearnResult
from gateway.core.scheduler import Scheduler
from gateway.errors import RefusedError
from gateway.log import Event
from gateway.records import iso_utc, ns_of, rounded
from gateway.service.learner.kept_drives import DriveFiles, Window
from gateway.service.learner.learning_file import MOST_LADEN, Book, Laden, LearntVersion
from gateway.service.learner.said import StatedLoads
from gateway.service.learner.van import StatedVan
from gateway.service.learner.worker import Worker
from gateway.stated.learning import STATES, Help, LearningState, Question, StatementTold, Version, VersionTold
from gateway.stated.statement import StatementSource
from gateway.units import NS_PER_S

NEWEST, BY_FILE = "newest", "file"
OTHER_TIME_NS: Final = 86_400 * NS_PER_S  # chosen: a bus whose time is further off than a day has a time of its own


class Learnt:
    """What the vehicle has learnt, and which version of it is used. Thread-safe; a call may wait for the disk."""

    def __init__(
        self,
        book: Book,
        files: DriveFiles,
        van: StatedVan,
        loads: StatedLoads,
        drives: Scheduler,
        worker: Worker,
        fault: Callable[[], str | None],
        n_lost: Callable[[], int],
    ) -> None:
        """``fault`` says what keeps the learner from learning, ``n_lost`` how many windows it could not keep."""
        self._book, self._files, self._van, self._loads = book, files, van, loads
        self._scheduler, self._worker, self._fault, self._n_lost = drives, worker, fault, n_lost
        self._started_with = self._active_id

    @property
    def _active_id(self) -> str | None:
        active = self._book.record.active
        return active.id if active else None

    @property
    def is_due(self) -> bool:
        """Whether another calibration than at the start waits for the next drive."""
        return self._active_id != self._started_with

    def state(self) -> str:
        """JSON: a LearningState."""
        with self._book.lock:
            return self._state().model_dump_json(by_alias=True)

    def _state(self) -> LearningState:
        record, vehicle = self._book.record, self._van.known
        windows, window_ns = self._files.windows(), self._scheduler.open_window_ns
        last, told = record.last, self._loads.told(record.said)
        learning = last.learning if last is not None else {}
        open_s = 0.0 if window_ns is None else (window_ns[1] - window_ns[0]) / NS_PER_S
        counts = Counter(one.state for one in told)
        return LearningState(
            is_allowed=self._van.given.why_not_allowed is None,
            why_not=self._van.given.why_not_allowed,
            vehicle_time=iso_utc(self._vehicle_time_ns(windows)),
            plus_minus_kg=learning.get("plus_minus_kg"),
            useful_at_kg=None if vehicle is None else rounded(vehicle.useful_half_width_kg, 1),
            tested_on=learning.get("tested_on", 0),
            helps=[Help.model_validate(one) for one in learning.get("helps", ())],
            findings=[*learning.get("findings", ()), *([last.fault] if last and last.fault else [])],
            takes_effect="next_drive" if self.is_due else None,
            lacks=list(self._lacks(windows)),
            is_learning=self._worker.is_busy,
            driven_s=round(sum(one.usable_s for one in windows) + open_s, 1),
            n_drives=len({one.drive_start_ns for one in windows}),
            n_windows_lost=self._n_lost(),
            statements={name: counts.get(name, 0) for name in STATES},
            questions=list(self._questions(told, last)),
            versions=[self._version_told(one) for one in reversed(record.versions)],
            held_version=record.held,
            fault=self._fault(),
        )

    def _vehicle_time_ns(self, windows: Sequence[Window]) -> int:
        """The time that a statement without one is of: in a replay or a demonstration the bus has a time of its own."""
        now_ns, window_ns = self._book.clock_ns(), self._scheduler.open_window_ns
        bus_ns = [one.t_end_ns for one in windows] if window_ns is None else [window_ns[1]]
        newest_ns = max(bus_ns, default=now_ns)
        return newest_ns if abs(now_ns - newest_ns) > OTHER_TIME_NS else now_ns

    def _lacks(self, windows: Sequence[Window]) -> Iterator[Any]:
        stated = self._book.record.vehicle
        if stated is None:
            yield "vehicle"
        elif self._van.learnt is None:
            yield "confirmed_vehicle"
        if not windows:
            yield "drives"

    def _questions(self, told: Sequence[StatementTold], last: LearnResult | None) -> Iterator[Question]:
        for one in told:
            if one.question and one.state in ("held", "weak"):
                kind = "held" if one.state == "held" else "weak"
                named = one.ref or f"the statement from {iso_utc(one.from_ns)[:16]}Z"
                yield Question(kind=kind, text=f"{named}: {one.question}", statement_id=one.id)
        drives = self._looking_empty(last)
        if not drives:
            return
        begun = ", ".join(f"{str(one['t_start'])[:16]}Z" for one in drives)
        which = f"The drive of {begun} looks" if len(drives) == 1 else f"These {len(drives)} drives look"
        listed = "" if len(drives) == 1 else f" ({begun})"
        source = str(StatementSource.EMPTY)
        propose = tuple({"from": one["t_start"], "until": one["t_end"], "source": source} for one in drives)
        yield Question(kind="looks_empty", text=f"{which} empty{listed}. Is that right?", propose=propose)

    def _looking_empty(self, last: LearnResult | None) -> list[dict[str, Any]]:
        """The drives that look empty, unless somebody said that they carried a load."""
        laden = [one.span for one in self._book.record.laden]
        found = [one for one in last.drives if one["number"] in last.looks_empty] if last else []
        return [one for one in found if not any(Piece(*_span_of(one), one["number"]).meets(*span) for span in laden)]

    def not_empty(self, begins_ns: Sequence[int], by: str) -> str:
        """These drives, by their begin, look empty and were not: they are not asked about again; JSON: LearningState.

        Raises RefusedError for a drive that is not asked about; then nothing has changed.
        """
        with self._book.lock:
            record = self._book.record
            asked = {span[0]: span for one in self._looking_empty(record.last) for span in (_span_of(one),)}
            if any(begin_ns not in asked for begin_ns in begins_ns):
                raise RefusedError("no_such_drive", "no drive that looks empty begins then: the questions list them")
            act = self._book.act(by)
            said = [Laden(begin_ns=begin, end_ns=end, said=act) for begin, end in map(asked.__getitem__, begins_ns)]
            self._book.save(record.model_copy(update={"laden": (*record.laden, *said)[-MOST_LADEN:]}))
            self._book.tell(Event.NOT_EMPTY, {"n": len(said), "by": by})
            return self._state().model_dump_json(by_alias=True)

    def _version_told(self, one: LearntVersion) -> VersionTold:
        state = "earlier"
        if one.id == self._active_id:
            state = "in_use" if one.id == self._started_with else "next_drive"
        elif one.worse is not None:
            state = "worse"
        told = {name: getattr(one, name) for name in Version.model_fields}
        text = one.text + (f"; not used: {one.worse}" if one.worse else "")
        return VersionTold.model_validate({**told, "text": text, "state": state})

    def use(self, version: str, by: str) -> str:
        """Use this version from the next drive on, or the newest, or the file of the settings; JSON: LearningState."""
        self._van.require_allowed()
        with self._book.lock:
            record = self._book.record
            if version not in (NEWEST, BY_FILE) and all(one.id != version for one in record.versions):
                raise RefusedError("no_such_version", "there is no such version: GET /api/v1/learning lists them")
            self._book.save(record.model_copy(update={"held": None if version == NEWEST else version}))
            self._book.tell(Event.VERSION_CHOSEN, {"use": version, "by": by})
            return self._state().model_dump_json(by_alias=True)


def _span_of(drive: Mapping[str, Any]) -> tuple[int, int]:
    return ns_of(str(drive["t_start"])), ns_of(str(drive["t_end"]))
