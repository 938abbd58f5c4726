"""The files of a data set: receipts, and the tables that they cover. Readers trust receipts only.

    DATASET/estimates/vehicle=van-17/month=2026-03/JOB.parquet   one row per batch; written first
    DATASET/receipts/vehicle=van-17/month=2026-03/JOB.json       written last, once: the table beside it is complete
    DATASET/failed/vehicle=van-17/month=2026-03/NAME.json        a failed log or job, with the reason

JOB is the hash of all inputs of the table. A listing alone gives vehicle, month and job.
"""

import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gateway.archive.places import Item, Location, place_of

ESTIMATES: Final = "estimates"
RECEIPTS: Final = "receipts"
FAILED: Final = "failed"
FORMAT: Final = "springscale-receipt"
FORMAT_VERSION: Final = 1  # of receipts
_NAME: Final = re.compile(r"vehicle=(?P<vehicle>[^/]+)/month=(?P<month>[^/]+)/(?P<job>[^/]+)\.json$")


@dataclass(frozen=True, slots=True, order=True)
class Slot:
    """A job's place in the data set: vehicle, month and the hash of its inputs."""

    vehicle: str
    month: str  # 2026-03, by the first frame of a log, UTC; "unknown" where no log has a readable frame
    job: str

    @property
    def folder(self) -> str:
        """Named like Hive partitions."""
        return f"vehicle={self.vehicle}/month={self.month}"

    @property
    def table(self) -> str:
        return f"{ESTIMATES}/{self.folder}/{self.job}.parquet"

    @property
    def receipt(self) -> str:
        return f"{RECEIPTS}/{self.folder}/{self.job}.json"

    def failure(self, log: str | None = None) -> str:
        """The path of the failure of the job, or of one of its logs by name."""
        name = self.job if log is None else f"{self.job}-{hashlib.sha256(log.encode()).hexdigest()[:16]}"
        return f"{FAILED}/{self.folder}/{name}.json"


def slots_done(dataset: Location) -> list[Slot]:
    """Every job with a receipt, by a listing."""
    return _slots(dataset.items(RECEIPTS))


def slots_failed(dataset: Location) -> list[Slot]:
    """Every failed job; not those with only a failed log."""
    return [slot for slot in _slots(dataset.items(FAILED)) if "-" not in slot.job]


def failure_files(dataset: Location) -> list[tuple[Slot, str]]:
    """Every failure file, with its job."""
    named = ((_NAME.search(item.path), item.path) for item in dataset.items(FAILED))
    return [(Slot(one["vehicle"], one["month"], one["job"].partition("-")[0]), path) for one, path in named if one]


def trusted_tables(dataset: Location | Path | str) -> list[str]:
    """The Parquet files covered by receipts, as paths or URLs for polars, DuckDB and pyarrow."""
    place = _place(dataset)
    return [str(place.local(slot.table) or f"{place.url}/{slot.table}") for slot in slots_done(place)]


def receipts(dataset: Location | Path | str) -> list[dict[str, Any]]:
    """The content of every receipt, in order of vehicle and month."""
    place = _place(dataset)
    return [json.loads(place.read(slot.receipt)) for slot in slots_done(place)]


def failures(dataset: Location | Path | str) -> list[dict[str, Any]]:
    """All failures with their reasons: unreadable logs, and whole jobs (``log`` is null)."""
    place = _place(dataset)
    return [json.loads(place.read(item.path)) for item in place.items(FAILED)]


def text_of(receipt: Mapping[str, Any]) -> bytes:
    content = {"format": FORMAT, "version": FORMAT_VERSION, **receipt}
    return (json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def _place(dataset: Location | Path | str) -> Location:
    return dataset if isinstance(dataset, Location) else place_of(dataset)


def _slots(items: Iterable[Item]) -> list[Slot]:
    named = (_NAME.search(item.path) for item in items)
    return sorted(Slot(**one.groupdict()) for one in named if one)
