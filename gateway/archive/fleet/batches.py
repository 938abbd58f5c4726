"""The batches of one vehicle as columns for the fleet's report, read file by file."""

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress, groupby
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from gateway.archive.dataset import SCHEMA_VERSION, pyarrow_and_parquet
from gateway.archive.places import Location, PlaceError
from gateway.archive.receipts import Slot
from gateway.errors import ConfigurationError
from gateway.records import F64, I64, Bool

if TYPE_CHECKING:
    import pyarrow as pa

OF_VEHICLE: Final[Mapping[str, str]] = MappingProxyType(
    {
        "damper_front_ratio": "front dampers, of the calibrated",
        "damper_rear_ratio": "rear dampers, of the calibrated",
        "delay_scale": "rear axle later than the wheelbase says, share",
        "roll_share_front": "front axle's part of a sideways load",
    }
)
OF_SENSOR: Final[Mapping[str, str]] = MappingProxyType(
    {
        "misfit": "misfit of the calibrated vehicle",
        "tension": "distance from the calibrated vehicle",
        "sensor_position_deviation": "another place of the sensor",
        "sensor_noise_deviation": "more noise in the acceleration",
    }
)
DRIFTING: Final = (*OF_VEHICLE, *OF_SENSOR)
_NUMBERS: Final = ("payload_kg", "payload_std_kg", "payload_own_std_kg", *DRIFTING)
_COLUMNS: Final = ("t_end_ns", "calibration_id", "rejected", "over_limit", *_NUMBERS)


@dataclass(frozen=True, slots=True, eq=False)
class Batches:
    """Batches of one vehicle, in order of time: arrays (n,), NaN where unknown.

    ``numbers`` are columns of the data set by name; ``rejected`` has for each reason the batches that it refused. A
    batch is answered if no reason refused it.
    """

    t_end_ns: I64
    calibration_id: tuple[str, ...]
    numbers: Mapping[str, F64]
    rejected: Mapping[str, Bool]
    is_over_limit: Bool

    def __len__(self) -> int:
        return len(self.t_end_ns)

    @property
    def is_answered(self) -> Bool:
        answered: Bool = ~np.any([np.zeros(len(self), dtype=bool), *self.rejected.values()], axis=0)
        return answered

    def rows(self, chosen: Bool) -> "Batches":
        return Batches(
            self.t_end_ns[chosen],
            tuple(compress(self.calibration_id, chosen)),
            {name: numbers[chosen] for name, numbers in self.numbers.items()},
            {reason: refused[chosen] for reason, refused in self.rejected.items()},
            self.is_over_limit[chosen],
        )


def by_vehicle(slots: Sequence[Slot]) -> Iterator[tuple[str, list[Slot]]]:
    """The jobs of each vehicle, in order."""
    for vehicle, jobs in groupby(sorted(slots), lambda slot: slot.vehicle):
        yield vehicle, list(jobs)


def read_batches(dataset: Location, jobs: Sequence[Slot]) -> Batches:
    """Every batch of some jobs of one vehicle. Raises PlaceError, or ConfigurationError for an invalid table.

    The memory needed is that of these columns of these jobs.
    """
    parts = [_read(dataset, slot) for slot in jobs]
    t_end_ns = np.concatenate([part.t_end_ns for part in parts])
    order = np.argsort(t_end_ns, kind="stable")
    _require_once(t_end_ns[order], np.repeat(np.arange(len(jobs)), [len(part) for part in parts])[order], jobs)
    ids = [one for part in parts for one in part.calibration_id]
    reasons = sorted({reason for part in parts for reason in part.rejected})
    return Batches(
        t_end_ns[order],
        tuple(ids[n] for n in order),
        {name: np.concatenate([part.numbers[name] for part in parts])[order] for name in _NUMBERS},
        {
            reason: np.concatenate([part.rejected.get(reason, np.zeros(len(part), dtype=bool)) for part in parts])[
                order
            ]
            for reason in reasons
        },
        np.concatenate([part.is_over_limit for part in parts])[order],
    )


def _require_once(t_end_ns: I64, job: I64, jobs: Sequence[Slot]) -> None:
    """Raises ConfigurationError if two jobs have the same batch, which would count twice."""
    again = np.flatnonzero((np.diff(t_end_ns) == 0) & (np.diff(job) != 0))
    if again.size:
        one, other = (jobs[job[again[0] + k]].receipt for k in (0, 1))
        raise ConfigurationError(
            f"{one} and {other} vouch for the same {again.size} batches, which would count twice: remove the receipt "
            "whose inputs are no longer those of the archive"
        )


def _read(dataset: Location, slot: Slot) -> Batches:
    pa, pq = pyarrow_and_parquet()
    where = f"{dataset}/{slot.table}"
    try:
        file = pq.ParquetFile(io.BytesIO(dataset.read(slot.table)))
        _require_known(file.schema_arrow, where)
        return _batches_of(file.read(columns=list(_COLUMNS)))
    except FileNotFoundError:
        raise PlaceError(
            f"{where}: is missing, though a receipt vouches for it: remove {slot.receipt} and run "
            "`springscale reprocess` again, which writes it again"
        ) from None
    except pa.ArrowInvalid as fault:
        raise PlaceError(
            f"{where}: is no Parquet file ({str(fault).splitlines()[0]}): remove it and {slot.receipt}, and run "
            "`springscale reprocess` again"
        ) from None


def _require_known(schema: "pa.Schema", where: str) -> None:
    told = (schema.metadata or {}).get(b"springscale_schema", b"").decode()
    if not told.isdigit():
        raise ConfigurationError(f"{where}: is no table of `springscale reprocess`: it names no springscale_schema")
    if int(told) > SCHEMA_VERSION:
        raise ConfigurationError(
            f"{where}: has schema {told}, this springscale knows up to {SCHEMA_VERSION}: install a newer one"
        )


def _batches_of(table: "pa.Table") -> Batches:
    return Batches(
        table["t_end_ns"].to_numpy(),
        tuple(one or "" for one in table["calibration_id"].to_pylist()),
        {name: table[name].to_numpy().astype(np.float64) for name in _NUMBERS},
        _reasons(table["rejected"].combine_chunks()),
        _lengths(table["over_limit"].combine_chunks()) > 0,
    )


def _lengths(lists: Any) -> I64:
    counts: I64 = np.asarray(lists.value_lengths().fill_null(0)).astype(np.int64)
    return counts


def _reasons(lists: Any) -> dict[str, Bool]:
    """Finds, for each text in a column of lists, the rows that contain it."""
    row = np.repeat(np.arange(len(lists)), _lengths(lists))
    told = lists.flatten().dictionary_encode()
    code = np.asarray(told.indices)
    found = {}
    for n, reason in enumerate(told.dictionary.to_pylist()):
        of_rows = np.zeros(len(lists), dtype=bool)
        of_rows[row[code == n]] = True
        found[str(reason)] = of_rows
    return found
