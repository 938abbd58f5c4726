"""The batches of one vehicle as a polars frame, read table by table."""

import io
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

import polars as pl

from gateway.archive.dataset import SCHEMA_KEY, SCHEMA_VERSION
from gateway.archive.places import Location, PlaceError
from gateway.archive.receipts import Slot
from gateway.errors import ConfigurationError
from gateway.estimates.reasons import EXPLANATIONS, Cause
from gateway.units import NS_PER_DAY

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
_READ: Final = (
    "t_end_ns", "calibration_id", "rejected", "over_limit",
    "payload_kg", "payload_std_kg", "payload_own_std_kg", *DRIFTING,
)  # fmt: skip
DAYS_BEFORE: Final = 3  # of the week that holds 1970-01-01, a Thursday

REASONS_OF: Final[Mapping[Cause, list[str]]] = {
    cause: [str(why) for why, told in EXPLANATIONS.items() if told.cause is cause] for cause in Cause
}


def read_batches(dataset: Location, jobs: Sequence[Slot]) -> pl.DataFrame:
    """Every batch of some jobs of one vehicle in order of time. Raises PlaceError, or ConfigurationError for an invalid
    table.

    Besides columns of the data set a row has its ``day`` and its ``week``, counted from 1970-01-01 and from the Monday
    before it (UTC), whether it ``is_answered`` (no reason refused it), and for each cause whether a reason of that
    cause refused it. Unknown is null.
    """
    read = [_read(dataset, slot).with_columns(receipt=pl.lit(slot.receipt)) for slot in jobs]
    batches = pl.concat(read).sort("t_end_ns", maintain_order=True)
    _require_once(batches)
    day = pl.col("t_end_ns") // NS_PER_DAY
    return batches.with_columns(
        day=day,
        week=(day + DAYS_BEFORE) // 7,
        is_answered=pl.col("rejected").list.len() == 0,
        **{
            str(cause): pl.col("rejected").list.eval(pl.element().is_in(reasons)).list.any()
            for cause, reasons in REASONS_OF.items()
        },
    )


def _require_once(batches: pl.DataFrame) -> None:
    """Raises ConfigurationError if two jobs have the same batch, which would count twice."""
    again = batches.group_by("t_end_ns").agg(pl.col("receipt").unique().sort()).filter(pl.col("receipt").list.len() > 1)
    if len(again):
        raise ConfigurationError(
            f"{' and '.join(again['receipt'][0])} vouch for the same {len(again)} batches, which would count twice: "
            "remove the receipt whose inputs are no longer those of the archive"
        )


def _read(dataset: Location, slot: Slot) -> pl.DataFrame:
    where = f"{dataset}/{slot.table}"
    try:
        file = io.BytesIO(dataset.read(slot.table))
        _require_known(pl.read_parquet_metadata(file).get(SCHEMA_KEY, ""), where)
        return pl.read_parquet(file, columns=list(_READ))
    except FileNotFoundError:
        raise PlaceError(
            f"{where}: is missing, though a receipt vouches for it: remove {slot.receipt} and run "
            "`springscale reprocess` again, which writes it again"
        ) from None
    except pl.exceptions.PolarsError as fault:
        raise PlaceError(
            f"{where}: is no Parquet file ({str(fault).splitlines()[0]}): remove it and {slot.receipt}, and run "
            "`springscale reprocess` again"
        ) from None


def _require_known(version: str, where: str) -> None:
    if not version.isdigit():
        raise ConfigurationError(f"{where}: is no table of `springscale reprocess`: it names no {SCHEMA_KEY}")
    if int(version) > SCHEMA_VERSION:
        raise ConfigurationError(
            f"{where}: has schema {version}, this springscale knows up to {SCHEMA_VERSION}: install a newer one"
        )
