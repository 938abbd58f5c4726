"""Verification of a running service: known loads compared with its estimates, stored as dated records."""

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gateway.calibration.known_weight import WeightRefusal, load_of
from gateway.calibration.verification_file import (
    FILE_NAME,
    VerificationHistory,
    axle_errors,
    is_within,
    verdict_of,
    with_its_id,
)
from gateway.errors import RefusedError
from gateway.log import Event, OnEvent, tell_event
from gateway.quantity import Quantity
from gateway.records import iso_utc, json_line, ns_of
from gateway.service.record_file import RecordFile
from gateway.service.verification.epochs import WeighedEpoch, epoch_at, epochs_around
from gateway.setup import Subject
from gateway.stated.facts import LoadTold, Rule, StatedWeight, VerificationRecord
from gateway.status import VerificationStatus
from gateway.store import StoreReader
from gateway.units import NS_PER_DAY
from gateway.weighing.calibrated import CalibratedVehicle


class VerificationService:
    """Judges known loads and stores the records. Thread-safe; a call may wait for the disk."""

    def __init__(
        self,
        directory: Path,
        subject: Subject,
        reader: StoreReader,
        rule: Rule,
        *,
        payload_without: Callable[[WeighedEpoch], Quantity] = lambda epoch: epoch.payload,
        every_days: float,
        on_event: OnEvent,
        clock_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        """``reader`` gives the stored estimates; ``every_days`` 0: a verification is never due.

        ``payload_without`` estimates a load without its own known weight.
        """
        self._subject = subject
        self._reader = reader
        self._rule = rule
        self._payload_without = payload_without
        self._every_days = every_days
        self._on_event = on_event
        self._clock_ns = clock_ns
        self._lock = threading.Lock()
        self._file = RecordFile(directory / FILE_NAME, VerificationHistory())

    @property
    def fault(self) -> str | None:
        """Faults of the file, and a due verification, for people."""
        due = self.status()
        last = "there is none of this calibration" if due.last_at is None else f"the last was {due.last_at[:10]}"
        return self._file.fault or (f"a verification with known loads is due: {last}" if due.is_due else None)

    def status(self) -> VerificationStatus:
        """When the present calibration was last verified, and whether it is due."""
        own = [entry for entry in self._file.record.entries if entry.calibration_id == self._subject.calibration_id]
        last = own[-1] if own else None
        is_asked_for = self._every_days > 0.0 and self._subject.calibrated is not None
        due_ns = None
        if is_asked_for:
            passed = [entry for entry in own if entry.verdict == "passed"]
            every_ns = round(self._every_days * NS_PER_DAY)
            due_ns = ns_of(passed[-1].at) + every_ns if passed else self._clock_ns()
        return VerificationStatus(
            n_records=len(self._file.record.entries),
            last_at=None if last is None else last.at,
            last_verdict=None if last is None else last.verdict,
            due_at=None if due_ns is None else iso_utc(due_ns),
            is_due=due_ns is not None and self._clock_ns() >= due_ns,
        )

    def state(self) -> str:
        """JSON: the requirements, when the next one is due, and the records, newest first."""
        entries = [entry.model_dump(mode="json") for entry in reversed(self._file.record.entries)]
        return json_line(
            {
                "rule": self._rule.model_dump(),
                "due": asdict(self.status()),
                "warning": self._file.fault,
                "history": entries,
            }
        )

    def record(self, record_id: str) -> Mapping[str, Any] | None:
        found = next((entry for entry in self._file.record.entries if entry.id == record_id), None)
        return None if found is None else found.model_dump(mode="json")

    def verify(self, by: str, note: str | None, stated: Sequence[StatedWeight]) -> str:
        """Judge these known loads -> the new record as JSON, on disk. Raises RefusedError and stores nothing."""
        calibrated = self._subject.calibrated
        if calibrated is None:
            raise RefusedError(WeightRefusal.NO_CALIBRATION, "there is no calibration, and so nothing to verify")
        epochs = [epoch_at(epochs_around(self._reader, ns_of(one.at)), ns_of(one.at), one.drive) for one in stated]
        loads = tuple(self._judged(one, epoch, calibrated) for one, epoch in zip(stated, epochs, strict=True))
        unnamed = VerificationRecord(
            id="",
            at=iso_utc(self._clock_ns()),
            by=by,
            note=note,
            vehicle_id=self._subject.vehicle_id,
            calibration_id=calibrated.id,
            estimator=self._subject.estimator,
            known_weights_id=epochs[-1].known_weights_id,
            rule=self._rule,
            loads=loads,
            verdict=verdict_of(self._rule, loads),
        )
        entry = with_its_id(unnamed)
        with self._lock:
            try:
                self._file.keep(self._file.record.with_entry(entry))
            except OSError as fault:
                raise RefusedError(WeightRefusal.NOT_STORED, f"the record cannot be kept: {fault}") from None
        told: dict[str, Any] = {"verification_id": entry.id, "by": by, "verdict": entry.verdict, "n_loads": len(loads)}
        tell_event(Event.VERIFIED, told, self._on_event)
        return json_line(entry.model_dump(mode="json"))

    def _judged(self, stated: StatedWeight, epoch: WeighedEpoch, calibrated: CalibratedVehicle) -> LoadTold:
        epoch.require(calibrated.id, self._subject.estimator)
        vehicle = calibrated.vehicle
        known = load_of(stated, vehicle, calibrated.unsprung)
        payload = self._payload_without(epoch)
        reference_kg = vehicle.empty_mass_kg + known.payload_kg if known.gross_kg is None else known.gross_kg
        error_kg = payload.number - known.payload_kg
        error_pct = 100.0 * error_kg / reference_kg
        front, rear = axle_errors(known, payload.number, epoch.front_share.number, vehicle)
        return LoadTold(
            stated=stated,
            t_start=iso_utc(epoch.t_start_ns),
            t_end=iso_utc(epoch.t_end_ns),
            n_batches=epoch.n_batches,
            batch_ids=epoch.batch_ids,
            known_payload_kg=known.payload_kg,
            known_reference_kg=reference_kg,
            payload_kg=payload.number,
            payload_std_kg=payload.std,
            error_kg=error_kg,
            error_pct=error_pct,
            front_axle=front,
            rear_axle=rear,
            is_within=is_within(self._rule, error_pct, front, rear),
        )
