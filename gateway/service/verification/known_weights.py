"""Known weights of a running service: "it is empty now", tickets, axle pads, delivery notes.

Each is attached to a weighed load and stored with the measured posterior of that load. Their combined effect
(core.known_weights) is computed whenever the list changes, and applies from the next batch on.
"""

import math
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

from gateway.calibration.known_weight import WeightRefusal, load_of
from gateway.calibration.known_weights_file import FILE_NAME, KnownWeight, KnownWeights
from gateway.core.known_weights import KnownWeightKind
from gateway.errors import RefusedError
from gateway.estimate_json import posterior_to_json
from gateway.log import Event, OnEvent, tell_event
from gateway.posterior import FRONT_SHARE, PAYLOAD, Posterior, Source
from gateway.quantity import Quantity
from gateway.records import iso_utc, json_line, ns_of
from gateway.service.pipeline import Pipeline
from gateway.service.record_file import RecordFile
from gateway.service.verification.epochs import WeighedEpoch, epoch_at, epochs_around
from gateway.setup import Subject
from gateway.stated.facts import Confirmation, Ending, StatedWeight
from gateway.store import StoreReader
from gateway.weighing.calibrated import CalibratedVehicle

ALL_KINDS: Final = tuple(KnownWeightKind)


class _Load(NamedTuple):
    """One load: its measured posterior and its batches."""

    posterior: Posterior
    t_start_ns: int
    t_end_ns: int
    n_batches: int
    batch_ids: tuple[str, ...]


class KnownWeightService:
    """Stores and applies known weights, on disk before the answer. Thread-safe; a call may wait for the disk."""

    def __init__(
        self,
        directory: Path,
        subject: Subject,
        pipeline: Pipeline,
        reader: StoreReader,
        *,
        stale_after_s: float,
        on_event: OnEvent,
        clock_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        """Reads the file and applies its known weights. ``reader`` gives the stored estimates.

        A damaged file is set aside: weighing goes on without known weights, and ``fault`` says so.
        """
        self._subject, self._pipeline, self._reader = subject, pipeline, reader
        self._stale_after_s = stale_after_s
        self._on_event = on_event
        self._clock_ns = clock_ns
        self._lock = threading.Lock()
        self._file = RecordFile(directory / FILE_NAME, KnownWeights())
        self._use()

    @property
    def fault(self) -> str | None:
        """Faults of the file, and known weights that wait for a confirmation, for people."""
        held = [one for one in self._own() if one.is_held]
        if self._file.fault or not held:
            return self._file.fault
        return "; ".join(
            f"a known weight of {one.payload_kg:.0f} kg contradicts the estimate of {one.estimated_payload_kg:.0f} "
            f"± {1.96 * one.estimated_payload_std_kg:.0f} kg: confirm it or take it back"
            for one in held
        )

    def state(self, kinds: Sequence[KnownWeightKind] = ALL_KINDS) -> str:
        """JSON: a KnownWeightState with the entries of these kinds."""
        own = self._own()
        knowledge = self._pipeline.flow.knowledge
        errors = [one.estimated_payload_kg - one.payload_kg for one in own if one.teaches]
        n = len(errors)
        mean = sum(errors) / n if n else math.nan
        std = math.sqrt(sum((error - mean) ** 2 for error in errors) / (n - 1)) if n > 1 else math.nan
        return json_line(
            {
                "known_weights_id": None if knowledge is None else knowledge.id,
                "n_teaching": n,
                "mean_error_kg": None if math.isnan(mean) else mean,
                "error_std_kg": None if math.isnan(std) else std,
                "offer": self._offer(),
                "fault": self._file.fault,
                "history": [self._shown(one) for one in reversed(self._file.record.entries) if one.kind in kinds],
            }
        )

    def add(self, kind: KnownWeightKind, by: str, note: str | None, stated: StatedWeight | None = None) -> str:
        """One more known weight -> its JSON. Without a stated load the vehicle is empty now. Raises
        RefusedError.
        """
        with self._lock:
            calibrated = self._calibrated()
            if stated is None:
                load = self._present()
                at = iso_utc(load.t_end_ns)
                stated_load = load_of(StatedWeight(at, payload_kg=0.0), calibrated.vehicle, calibrated.unsprung, kind)
            else:
                load = self._at(stated, calibrated)
                stated_load = load_of(stated, calibrated.vehicle, calibrated.unsprung, kind)
            self._require_new(load)
            # a front share that was not weighed is that of the empty vehicle, so it shares that error with the estimate
            posterior = load.posterior if stated_load.is_share_weighed else load.posterior.without(Source.EMPTY_SHARE)
            estimated = self._estimated(load)
            entry = KnownWeight(
                id="",
                kind=kind,
                at=iso_utc(self._clock_ns()),
                by=by,
                note=note,
                vehicle_id=self._subject.vehicle_id,
                calibration_id=calibrated.id,
                estimator=self._subject.estimator,
                t_start=iso_utc(load.t_start_ns),
                t_end=iso_utc(load.t_end_ns),
                batch_ids=load.batch_ids,
                n_batches=load.n_batches,
                posterior=posterior_to_json(posterior),
                stated=stated,
                payload_kg=stated_load.payload_kg,
                payload_std_kg=stated_load.payload_std_kg,
                front_share_pct=stated_load.front_share_pct,
                front_share_std_pct=stated_load.front_share_std_pct,
                estimated_payload_kg=float(estimated.mean[PAYLOAD]),
                estimated_payload_std_kg=estimated.std(PAYLOAD),
                is_contradicted=False,
            )
            is_contradicted = replace(entry.observation, posterior=estimated).is_contradicted
            entry = entry.model_copy(update={"is_contradicted": is_contradicted})
            entry = entry.model_copy(update={"id": entry.content_id()})
            self._keep(self._file.record.with_entry(entry))
            self._tell(Event.WEIGHT_KNOWN, entry, by)
            return json_line(self._shown(entry))

    def confirm(self, by: str, entry_id: str) -> str:
        """Confirm a held entry, which is used from then on -> the state. Raises RefusedError."""
        with self._lock:
            entry = self._standing(entry_id)
            if not entry.is_held:
                raise RefusedError(WeightRefusal.NOT_HELD, "this known weight is in use: nothing to confirm")
            confirmed = Confirmation(at=iso_utc(self._clock_ns()), by=by)
            self._keep(self._file.record.changed(entry_id, confirmed=confirmed))
            self._tell(Event.WEIGHT_CONFIRMED, entry, by)
            return self.state()

    def take_back(self, by: str, entry_id: str, kinds: Sequence[KnownWeightKind] = ALL_KINDS) -> str:
        """Withdraw an entry -> the state of these kinds. Later estimates are as if it had never been stated."""
        with self._lock:
            entry = self._standing(entry_id)
            if entry.kind not in kinds:
                raise RefusedError(WeightRefusal.NO_SUCH_WEIGHT, _NO_SUCH)
            self._end([entry], by, "withdrawn")
            return self.state(kinds)

    def take_back_empty(self, by: str, *, to_factory: bool) -> str:
        """Withdraw the last "it is empty now", or all of them -> their state. Raises RefusedError."""
        with self._lock:
            standing = [one for one in self._own() if one.kind is KnownWeightKind.EMPTY and one.ended is None]
            if not standing:
                raise RefusedError(WeightRefusal.NO_SUCH_WEIGHT, "no tare is in use")
            self._end(standing if to_factory else standing[-1:], by, "back_to_factory" if to_factory else "withdrawn")
            return self.state((KnownWeightKind.EMPTY,))

    def payload_without(self, epoch: WeighedEpoch) -> Quantity:
        """The payload of a load, estimated without the known weights of that load."""
        others = [one for one in self._own() if not set(one.batch_ids) & set(epoch.batch_ids)]
        if len(others) == len(self._own()):
            return epoch.payload
        knowledge = KnownWeights(entries=tuple(others)).knowledge(self._subject.calibration_id, self._subject.estimator)
        measured = epoch.posterior
        known = measured if knowledge is None else knowledge.applied(measured, epoch.t_end_ns)
        return known.quantity(PAYLOAD)

    def _own(self) -> list[KnownWeight]:
        """Entries of the present calibration and estimator, oldest first."""
        own = (self._subject.calibration_id, self._subject.estimator)
        return [one for one in self._file.record.entries if (one.calibration_id, one.estimator) == own]

    def _shown(self, entry: KnownWeight) -> dict[str, Any]:
        shown = entry.model_dump(mode="json", exclude={"posterior"})
        is_own = (entry.calibration_id, entry.estimator) == (self._subject.calibration_id, self._subject.estimator)
        state = "ended" if entry.ended else "held" if entry.is_held else "in_use" if is_own else "other_calibration"
        return {**shown, "state": state}

    def _offer(self) -> dict[str, Any]:
        """The load at which "it is empty now" would be taken, or why there is none."""
        try:
            self._calibrated()
            load = self._present()
        except RefusedError as refusal:
            return {"is_possible": False, "reason": refusal.reason, "detail": str(refusal), "load": None}
        estimated = self._estimated(load)
        shown = {
            "payload_kg": float(estimated.mean[PAYLOAD]),
            "payload_std_kg": estimated.std(PAYLOAD),
            "front_share_pct": float(estimated.mean[FRONT_SHARE]),
            "front_share_std_pct": estimated.std(FRONT_SHARE),
            "n_batches": load.n_batches,
            "t_start": iso_utc(load.t_start_ns),
            "t_end": iso_utc(load.t_end_ns),
        }
        return {"is_possible": True, "reason": None, "detail": None, "load": shown}

    def _calibrated(self) -> CalibratedVehicle:
        if self._subject.calibrated is None:
            raise RefusedError(WeightRefusal.NO_CALIBRATION, "no calibration is loaded, so there is nothing to correct")
        return self._subject.calibrated

    def _present(self) -> _Load:
        """The last weighed load. Raises RefusedError if it may have changed or is stale."""
        flow, age_s = self._pipeline.flow, self._pipeline.weighed_age_s()
        weighed = flow.weighed
        if weighed is None or age_s is None:
            raise RefusedError(
                WeightRefusal.NO_COUNTED_BATCH,
                "no batch has counted since the service started: drive, empty, until one has",
            )
        if flow.load_may_have_changed:
            raise RefusedError(
                WeightRefusal.LOAD_MAY_HAVE_CHANGED,
                "the vehicle has stopped and driven on since it was weighed: wait for the next batch that counts",
            )
        if age_s > self._stale_after_s:
            raise RefusedError(
                WeightRefusal.STALE,
                f"it was weighed {age_s:.0f} s ago, and this needs less than {self._stale_after_s:.0f} s: "
                "drive, empty, until the next batch has counted",
            )
        epoch = weighed.epoch
        return _Load(epoch.posterior, epoch.t_start_ns, weighed.t_end_ns, epoch.n_batches, weighed.batch_ids)

    def _at(self, stated: StatedWeight, calibrated: CalibratedVehicle) -> _Load:
        """The stored load at the stated time. Raises RefusedError."""
        at_ns = ns_of(stated.at)
        epoch = epoch_at(epochs_around(self._reader, at_ns), at_ns, stated.drive)
        epoch.require(calibrated.id, self._subject.estimator)
        return _Load(epoch.posterior, epoch.t_start_ns, epoch.t_end_ns, epoch.n_batches, epoch.batch_ids)

    def _estimated(self, load: _Load) -> Posterior:
        """The estimate of the load by the calibration and the known weights in use."""
        knowledge = self._pipeline.flow.knowledge
        return load.posterior if knowledge is None else knowledge.applied(load.posterior, load.t_end_ns)

    def _require_new(self, load: _Load) -> None:
        standing = (one for one in self._own() if one.ended is None)
        other = next((one for one in standing if set(one.batch_ids) & set(load.batch_ids)), None)
        if other is not None:
            raise RefusedError(
                WeightRefusal.ALREADY_KNOWN,
                f"that load has a known weight already ({other.payload_kg:.0f} kg, {other.id[:19]}): take that back "
                f"first",
            )

    def _standing(self, entry_id: str) -> KnownWeight:
        found = next((one for one in self._file.record.entries if one.id == entry_id and one.ended is None), None)
        if found is None:
            raise RefusedError(WeightRefusal.NO_SUCH_WEIGHT, _NO_SUCH)
        return found

    def _end(self, entries: Sequence[KnownWeight], by: str, why: str) -> None:
        history = self._file.record
        end = Ending.model_validate({"at": iso_utc(self._clock_ns()), "by": by, "why": why})
        for entry in entries:
            history = history.changed(entry.id, ended=end)
        self._keep(history)
        for entry in entries:
            self._tell(Event.WEIGHT_TAKEN_BACK, entry, by)

    def _keep(self, history: KnownWeights) -> None:
        """On disk, then in use. Raises RefusedError if the disk refuses; then nothing has changed."""
        try:
            self._file.keep(history)
        except OSError as fault:
            raise RefusedError(
                WeightRefusal.NOT_STORED, f"the known weights cannot be written, so nothing has changed: {fault}"
            ) from None
        self._use()

    def _use(self) -> None:
        subject = self._subject
        self._pipeline.flow.knowledge = self._file.record.knowledge(subject.calibration_id, subject.estimator)

    def _tell(self, event: Event, entry: KnownWeight, by: str) -> None:
        """Write an event to the log and to the store."""
        weights = {"payload_kg": entry.payload_kg, "estimated_payload_kg": entry.estimated_payload_kg}
        said = {"known_weight_id": entry.id, "kind": str(entry.kind), "by": by, **weights, "is_held": entry.is_held}
        tell_event(event, said, self._on_event)


_NO_SUCH: Final = "there is no such known weight in use"
