"""What is said of loads: taken, kept, and told with what became of it."""

from collections.abc import Mapping, Sequence
from datetime import tzinfo
from typing import Any, Final

from gateway.calibration.assigned import Fate, assign, moments
from gateway.calibration.learning.spans import STATES, rows_record, rows_told, spans_of, standing
from gateway.calibration.statements_csv import StatementsFileError, ToldRow, ToldRows, read_statements
from gateway.errors import RefusedError
from gateway.log import Event
from gateway.service.learner.kept_drives import DriveFiles, Window
from gateway.service.learner.learning_file import MOST_STATEMENTS, Book, LearningRecord, Said
from gateway.service.learner.van import StatedVan
from gateway.stated.learning import ImportTold, StatementPage, StatementTold
from gateway.stated.statement import StatementRecord

NO_VEHICLE: Final = (
    "the vehicle is not known yet: state its axle weights, its wheelbase and the sensor's place, and answer what is "
    "asked of them"
)
NEXT_FIT: Final = "its drive is there: it is learnt from with the next fit"


class StatedLoads:
    """The statements of a vehicle's loads. Thread-safe; a call may wait for the disk."""

    def __init__(self, book: Book, files: DriveFiles, van: StatedVan) -> None:
        self._book, self._files, self._van = book, files, van
        self._fates_of: tuple[LearningRecord, tuple[Window, ...], dict[str, tuple[Fate, str]]] | None = None

    def state(self, record: StatementRecord, by: str) -> str:
        """Take one statement; JSON: a StatementTold. Raises RefusedError if another one has its id, or the disk fails.

        The same statement again changes nothing, unless it was withdrawn: then it stands again.
        """
        with self._book.lock:
            said = self._store([record.identified()], by)[0]
            return self.told([said])[0].model_dump_json(by_alias=True)

    def import_all(
        self,
        content: bytes,
        by: str,
        *,
        where: str,
        zone: tzinfo | None = None,
        is_dry_run: bool = False,
        may_come_again: bool = False,
    ) -> str:
        """Take the good rows of a table or a list; JSON: an ImportTold. Raises RefusedError if there is none.

        ``may_come_again``: the same content may be delivered twice, so what was withdrawn stays withdrawn.
        """
        try:
            told = read_statements(content, where, zone)
        except StatementsFileError as fault:
            raise RefusedError("unreadable", str(fault)) from None
        with self._book.lock:
            rows = [row for row in told.rows if self._is_mine(row)]
            if not told.rows and told.faults:
                lines = [line for lines in told.faults.values() for line in lines]
                raise RefusedError("unreadable", "; ".join(lines[:20]))
            records = [row.record for row in rows]
            stored = [] if is_dry_run else self._store(records, by, stands_again=not may_come_again)
            answer = self._imported(told, rows, stored, is_dry_run=is_dry_run)
        return answer.model_dump_json(by_alias=True)

    def _is_mine(self, row: ToldRow) -> bool:
        stated = self._book.record.vehicle
        return row.is_of(self._van.given.id, self._van.given.name, stated.figures.name if stated else "")

    def _store(self, records: Sequence[StatementRecord], by: str, *, stands_again: bool = True) -> list[Said]:
        """Put statements into the book at once; with ``stands_again`` also what was withdrawn.

        Raises RefusedError; then nothing has changed.
        """
        kept, taken = {one.record.id: one for one in self._book.record.said}, []
        is_changed = False
        for one in records:
            signed = one if one.by else one.model_copy(update={"by": by})
            known = kept.get(one.id)
            if known is not None and known.record != signed and known.record.model_copy(update={"by": one.by}) != one:
                raise RefusedError(
                    "id_taken",
                    f"{one.id} is another statement: leave its id out, or withdraw the other one and give a new id",
                )
            if known is not None and (known.withdrawn is None or not stands_again):
                taken.append(known)
                continue
            if known is None and len(kept) >= MOST_STATEMENTS:
                raise RefusedError("too_many", f"{MOST_STATEMENTS} statements are kept already")
            kept.pop(one.id, None)  # what is stated again comes after all others
            kept[one.id] = Said(record=signed if known is None else known.record, at=self._book.now())
            taken.append(kept[one.id])
            is_changed = True
        if is_changed:
            self._book.save(self._book.record.model_copy(update={"said": tuple(kept.values())}))
            self._book.tell(Event.STATED, {"n": len(taken), "by": by})
        return taken

    def _imported(
        self, told: ToldRows, rows: Sequence[ToldRow], stored: Sequence[Said], *, is_dry_run: bool
    ) -> ImportTold:
        """What became of the rows, each beside all statements that stand."""
        others = [one.effective for one in self._book.record.said if one.withdrawn is None]
        records = standing([*others, *(row.record for row in rows)])
        fates = self._fates(records)
        found = rows_record(told, rows, fates, "another")
        text = rows_told(found["n_rows"], found["n_match"], found["problems"])
        return ImportTold(**found, text=text, items=self.told(stored), is_dry_run=is_dry_run)

    def _fates(self, records: Sequence[StatementRecord]) -> dict[str, tuple[Fate, str]]:
        """By id what becomes of the statements before any fit, and why."""
        vehicle = self._van.known
        if vehicle is None:
            return {one.id: (Fate.WAITING, NO_VEHICLE) for one in records}
        pieces = spans_of([one.span for one in self._files.windows()], moments(records))
        assigned = assign(records, pieces, vehicle)
        return {one.id: (assigned.fates[i], assigned.reasons[i]) for i, one in enumerate(records)}

    def page(
        self, *, since_ns: int | None = None, state: str | None = None, limit: int = 500, cursor: str | None = None
    ) -> str:
        """JSON: a StatementPage, the newest first: by when they begin. Raises RefusedError for a foreign cursor."""
        with self._book.lock:
            every = sorted(self._book.record.said, key=lambda one: (one.record.from_ns, one.record.id), reverse=True)
            if since_ns is not None:
                every = [one for one in every if (one.record.until_ns or one.record.from_ns) >= since_ns]
            told = [one for one in self.told(every) if state is None or one.state == state]
        if cursor is not None:
            ids = [one.id for one in told]
            if cursor not in ids:
                raise RefusedError("bad_cursor", "this cursor is of no such list: begin anew without it")
            told = told[ids.index(cursor) + 1 :]
        page = told[:limit]
        more = page[-1].id if len(told) > limit else None
        return StatementPage(items=page, next_cursor=more).model_dump_json(by_alias=True)

    def withdraw(self, statement_id: str, by: str) -> str:
        """Withdraw a statement; JSON: a StatementTold. With the next fit it is as if it had never been stated."""
        with self._book.lock:
            said = self._standing(statement_id)
            changed = said.model_copy(update={"withdrawn": self._book.act(by)})
            self._book.save(self._book.record.changing(changed))
            self._book.tell(Event.STATEMENT_WITHDRAWN, {"id": statement_id, "by": by})
            return self.told([changed])[0].model_dump_json(by_alias=True)

    def confirm(self, statement_id: str, by: str) -> str:
        """Somebody has seen the contradiction, and the statement is right; JSON: a StatementTold."""
        with self._book.lock:
            said = self._standing(statement_id)
            if said.confirmed is None:
                said = said.model_copy(update={"confirmed": self._book.act(by)})
                self._book.save(self._book.record.changing(said))
                self._book.tell(Event.STATEMENT_CONFIRMED, {"id": statement_id, "by": by})
            return self.told([said])[0].model_dump_json(by_alias=True)

    def _standing(self, statement_id: str) -> Said:
        said = self._book.record.find(statement_id)
        if said is None:
            raise RefusedError("no_such_statement", "there is no such statement: the list has all of them")
        if said.withdrawn is not None:
            raise RefusedError("withdrawn", "this statement was withdrawn: state it anew")
        return said

    def told(self, chosen: Sequence[Said]) -> list[StatementTold]:
        """These statements with what became of them."""
        record, windows = self._book.record, self._files.windows()
        if self._fates_of is None or self._fates_of[0] is not record or self._fates_of[1] != windows:
            self._fates_of = (record, windows, self._fates(record.records))
        fates = self._fates_of[2]
        found = {one["id"]: one for one in record.last.statements} if record.last is not None else {}
        begun = {one["number"]: one["t_start"] for one in record.last.drives} if record.last is not None else {}
        return [self._one_told(one, fates.get(one.record.id), found.get(one.record.id), begun) for one in chosen]

    def _one_told(
        self, said: Said, fate: tuple[Fate, str] | None, found: Mapping[str, Any] | None, begun: Mapping[int, str]
    ) -> StatementTold:
        """``found`` is what the last fit found of it, ``begun`` when each of its drives began."""
        more: dict[str, Any] = {}
        if said.withdrawn is not None:
            state, why = "withdrawn", f"withdrawn by {said.withdrawn.by}, {said.withdrawn.at[:16]}Z"
        elif fate is None:
            state, why = "withdrawn", f"replaced by a later one with the ref {said.record.ref}"
        elif found is not None and found["confirmed"] == said.effective.confirmed and fate[0] is Fate.MATCHED:
            state, why = found["state"], found["reason"]
            drives = [begin for number, begin in begun.items() if number in found["drives"]]
            more = {"found": found["found"], "question": found["question"], "drives": drives}
        else:
            state, why = STATES[fate[0]], fate[1] or (NO_VEHICLE if self._van.learnt is None else NEXT_FIT)
        told = {**said.effective.model_dump(mode="json", by_alias=True), "at": said.at, "state": state, "reason": why}
        return StatementTold.model_validate({**told, "vehicle": self._van.given.id, **more})
