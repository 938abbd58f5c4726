"""What stands in a dataset: receipts, and the tables that they vouch for. Readers trust receipts only.

    DATASET/estimates/vehicle=van-17/month=2026-03/JOB.parquet   one row a batch; written first
    DATASET/receipts/vehicle=van-17/month=2026-03/JOB.json       written last, once: the table beside it is whole
    DATASET/failed/vehicle=van-17/month=2026-03/NAME.json        a log, or a whole job, that gave nothing, and why

JOB is the hash of everything that the table follows from. What is named here can be told from a listing alone.
"""

import hashlib
import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gateway.archive.places import Item, Place, place_of

ESTIMATES: Final = "estimates"
RECEIPTS: Final = "receipts"
FAILED: Final = "failed"
FORMAT: Final = "springscale-receipt"
FORMAT_VERSION: Final = 1
_NAME: Final = re.compile(r"vehicle=(?P<vehicle>[^/]+)/month=(?P<month>[^/]+)/(?P<job>[^/]+)\.json$")


@dataclass(frozen=True, slots=True, order=True)
class Slot:
    """A job's place in the dataset: whose batches, of which month, from which inputs."""

    vehicle: str
    month: str  # 2026-03, by the first frame of a log, UTC; "unknown" where no log has a readable frame
    job: str

    @property
    def folder(self) -> str:
        """As Hive names partitions."""
        return f"vehicle={self.vehicle}/month={self.month}"

    @property
    def table(self) -> str:
        """Where its rows are."""
        return f"{ESTIMATES}/{self.folder}/{self.job}.parquet"

    @property
    def receipt(self) -> str:
        """What vouches for them."""
        return f"{RECEIPTS}/{self.folder}/{self.job}.json"

    def failure(self, log: str | None = None) -> str:
        """Where it is told that the job, or one log of it by its name, gave nothing."""
        name = self.job if log is None else f"{self.job}-{hashlib.sha256(log.encode()).hexdigest()[:16]}"
        return f"{FAILED}/{self.folder}/{name}.json"


Wanted = Callable[[Slot], bool]


def every(slot: Slot) -> bool:
    """Nothing is left out."""
    return True


def slots_done(dataset: Place) -> list[Slot]:
    """Every job with a receipt, by a listing."""
    return _slots(dataset.items(RECEIPTS))


def slots_failed(dataset: Place) -> list[Slot]:
    """Every job that gave nothing at all; not those of which a log failed."""
    return [slot for slot in _slots(dataset.items(FAILED)) if "-" not in slot.job]


def failure_files(dataset: Place) -> list[tuple[Slot, str]]:
    """Every file that tells of a failure, and of which job."""
    named = ((_NAME.search(item.path), item.path) for item in dataset.items(FAILED))
    return [(Slot(one["vehicle"], one["month"], one["job"].partition("-")[0]), path) for one, path in named if one]


def trusted_tables(dataset: Place | Path | str, is_wanted: Wanted = every) -> list[str]:
    """The Parquet files that receipts vouch for, as paths or URLs that polars, DuckDB and pyarrow open."""
    place = _place(dataset)
    slots = filter(is_wanted, slots_done(place))
    return [str(place.local(slot.table) or f"{place.url}/{slot.table}") for slot in slots]


def receipts(dataset: Place | Path | str, is_wanted: Wanted = every) -> list[dict[str, Any]]:
    """Every receipt of the dataset, read; in order of vehicle and month."""
    place = _place(dataset)
    return [json.loads(place.read(slot.receipt)) for slot in filter(is_wanted, slots_done(place))]


def failures(dataset: Place | Path | str) -> list[dict[str, Any]]:
    """Everything that failed and why: logs that could not be read, and whole jobs (``log`` is null)."""
    place = _place(dataset)
    return [json.loads(place.read(item.path)) for item in place.items(FAILED)]


def text_of(receipt: Mapping[str, Any]) -> bytes:
    """A receipt's file."""
    content = {"format": FORMAT, "version": FORMAT_VERSION, **receipt}
    return (json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def _place(dataset: Place | Path | str) -> Place:
    return dataset if isinstance(dataset, Place) else place_of(dataset)


def _slots(items: Iterable[Item]) -> list[Slot]:
    named = (_NAME.search(item.path) for item in items)
    return sorted(Slot(**one.groupdict()) for one in named if one)
