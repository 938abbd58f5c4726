"""The files of a data set: receipts, and the tables that they cover. Readers trust receipts only.

    DATASET/estimates/vehicle=van-17/month=2026-03/JOB.parquet   one row per batch; written first
    DATASET/receipts/vehicle=van-17/month=2026-03/JOB.json       written last, once: the table beside it is complete

JOB is the hash of all inputs of the table. A listing alone gives vehicle, month and job.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from gateway.archive.places import Location, PlaceError, place_of

ESTIMATES: Final = "estimates"
RECEIPTS: Final = "receipts"
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


def slots_done(dataset: Location) -> list[Slot]:
    """Every job with a receipt, by a listing."""
    named = (_NAME.search(item.path) for item in dataset.items(RECEIPTS))
    return sorted(Slot(**one.groupdict()) for one in named if one)


def trusted_tables(dataset: Location | Path | str) -> list[str]:
    """The Parquet files covered by receipts, as paths or URLs for polars, DuckDB and pyarrow."""
    place = _place(dataset)
    return [str(place.local(slot.table) or f"{place.url}/{slot.table}") for slot in slots_done(place)]


def receipts(dataset: Location | Path | str) -> list[dict[str, Any]]:
    """The content of every receipt, in order of vehicle and month. Raises PlaceError for one that is damaged."""
    place = _place(dataset)
    return [_content(place, slot.receipt) for slot in slots_done(place)]


def _content(place: Location, path: str) -> dict[str, Any]:
    try:
        content: dict[str, Any] = json.loads(place.read(path))
    except ValueError as fault:
        raise PlaceError(
            f"{place}/{path}: is no receipt ({fault}): remove it and run `springscale reprocess` again"
        ) from None
    return content


def failures(dataset: Location | Path | str) -> list[dict[str, Any]]:
    """Every log that could not be read, with the reason."""
    return [
        {"vehicle": receipt["vehicle"], "month": receipt["month"], **log}
        for receipt in receipts(dataset)
        for log in receipt["failed_logs"]
    ]


def text_of(receipt: Mapping[str, Any]) -> bytes:
    content = {"format": FORMAT, "version": FORMAT_VERSION, **receipt}
    return (json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n").encode()


def _place(dataset: Location | Path | str) -> Location:
    return dataset if isinstance(dataset, Location) else place_of(dataset)
