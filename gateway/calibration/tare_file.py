"""tare.json: the history of a vehicle's tares, the newest last. Written by the service alone, in one step.

It lies beside the database, apart from the calibration file, which no tare changes.
"""

import json
from pathlib import Path
from typing import Final, Literal

from pydantic import Field, ValidationError

from gateway.calibration.file.calibration_file import content_id
from gateway.calibration.file.parts import Part
from gateway.core.tare import Tare, Weighed, Zero
from gateway.errors import ConfigurationError
from gateway.files.kept import KeptFiles
from gateway.records import iso_utc
from gateway.toml_file import describe_faults

FILE_NAME: Final = "tare.json"
MOST_ENTRIES: Final = 100  # the oldest beyond are forgotten

Ending = Literal["undone", "back_to_factory", "other_calibration"]


class TareEnd(Part):
    """When, by whom and why a tare was taken out of use."""

    at: str
    by: str
    why: Ending


class TareEntry(Part):
    """One tare: what the empty vehicle was weighed as, less what it is, and where that is from."""

    id: str = Field(description="sha256 of the canonical JSON of everything but id and ended")
    at: str
    by: str
    note: str | None
    vehicle_id: str | None
    calibration_id: str
    estimator: str
    payload_kg: float = Field(allow_inf_nan=False)
    payload_std_kg: float = Field(ge=0.0, allow_inf_nan=False)
    front_share_pct: float = Field(allow_inf_nan=False)
    front_share_std_pct: float = Field(ge=0.0, allow_inf_nan=False)
    n_batches: int = Field(ge=1)
    batch_ids: tuple[str, ...] = Field(description="the newest of the batches it rests on, newest last")
    t_start: str = Field(description="of the first batch it rests on")
    t_end: str = Field(description="of the last")
    ended: TareEnd | None = None

    def for_core(self) -> Tare:
        """The same in the core's terms."""
        zero = Zero(self.payload_kg, self.payload_std_kg, self.front_share_pct, self.front_share_std_pct)
        return Tare(self.id, self.calibration_id, self.estimator, zero)

    def content_id(self) -> str:
        """What ``id`` has to be."""
        return content_id(self.model_dump(mode="json", exclude={"id", "ended"}))


class TareHistory(Part):
    """All that is remembered, oldest first. The tares that have not ended lie one on the other: the last counts."""

    format: Literal["springscale-tare"] = "springscale-tare"
    version: Literal[1] = 1
    entries: tuple[TareEntry, ...] = ()

    def active(self, calibration_id: str | None, estimator: str) -> TareEntry | None:
        """The tare in use for this calibration and estimator; None: the factory zero."""
        standing = [entry for entry in self.entries if entry.ended is None]
        own = [entry for entry in standing if (entry.calibration_id, entry.estimator) == (calibration_id, estimator)]
        return own[-1] if own else None

    def with_entry(self, entry: TareEntry) -> "TareHistory":
        """With one more tare, which is then in use."""
        return self.model_copy(update={"entries": (*self.entries, entry)[-MOST_ENTRIES:]})

    def ended(self, ids: set[str], end: TareEnd) -> "TareHistory":
        """With these tares out of use."""
        entries = tuple(entry.model_copy(update={"ended": end}) if entry.id in ids else entry for entry in self.entries)
        return self.model_copy(update={"entries": entries})


def entry_of(
    weighed: Weighed,
    zero: Zero,
    *,
    at_ns: int,
    by: str,
    note: str | None,
    vehicle_id: str | None,
    calibration_id: str,
    estimator: str,
) -> TareEntry:
    """The entry of a new tare, its id filled in."""
    entry = TareEntry(
        id="",
        at=iso_utc(at_ns),
        by=by,
        note=note,
        vehicle_id=vehicle_id,
        calibration_id=calibration_id,
        estimator=estimator,
        payload_kg=zero.payload_kg,
        payload_std_kg=zero.payload_std_kg,
        front_share_pct=zero.front_share_pct,
        front_share_std_pct=zero.front_share_std_pct,
        n_batches=weighed.n_batches,
        batch_ids=weighed.batch_ids,
        t_start=iso_utc(weighed.epoch.t_start_ns),
        t_end=iso_utc(weighed.t_end_ns),
    )
    return entry.model_copy(update={"id": entry.content_id()})


def load_tares(path: Path) -> TareHistory:
    """The history in ``path``, empty where there is none yet. Raises ConfigurationError for a file that is none."""
    try:
        return history_of(KeptFiles(path.parent).read(path.name), path)
    except FileNotFoundError:
        return TareHistory()
    except OSError as fault:
        raise ConfigurationError(f"{path}: cannot be read: {fault.strerror or fault}") from None


def history_of(content: bytes, path: Path | str) -> TareHistory:
    """What such a file holds. Raises ConfigurationError, naming ``path``, where it cannot be believed."""
    try:
        history = TareHistory.model_validate_json(content)
    except ValidationError as fault:
        raise ConfigurationError(f"{describe_faults(path, fault)}: {_MEND}") from None
    changed = [entry.id for entry in history.entries if entry.id != entry.content_id()]
    if changed:
        raise ConfigurationError(f"{path}: tare {changed[0]} was changed after it was written: {_MEND}")
    return history


def save_tares(path: Path, history: TareHistory) -> None:
    """Replace the file in one step; on disk when this returns. Raises OSError, and then the old file stands."""
    text = json.dumps(history.model_dump(mode="json"), indent=1, allow_nan=False, ensure_ascii=False)
    KeptFiles(path.parent).write(path.name, (text + "\n").encode())  # no UTF-8, no file: it could not be read again


_MEND: Final = "restore it, or remove it to go on from the factory zero"
