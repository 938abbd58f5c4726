"""Writes docs/archive.md from gateway/archive; with --check only tells whether it is up to date."""

from pathlib import Path
from typing import Final

from generated import keep_up_to_date
from make_estimate import DIAGNOSTICS

from gateway.archive.dataset import OVER_LIMIT, PROVENANCE, SCHEMA_VERSION, columns
from gateway.estimate_json import FIELDS

PAGE: Final = Path(__file__).with_name("archive.md")
TYPES: Final = {
    "text": "string",
    "whole": "int64",
    "number": "double",
    "instant": "timestamp, µs, UTC",
    "texts": "list of strings",
    "numbers by name": "map string to double",
}
"""By the kinds of gateway.archive.dataset: as Parquet has them."""

INTRODUCTION: Final = """\
# A fleet's archive

Generated from `gateway/archive` by `python docs/make_archive.py`; do not edit by hand.

Whenever a method, a calibration or a limit has changed, the logs of a whole fleet are read anew, into one data set of
Parquet files that DuckDB, polars and pandas read. Reading and writing it wants
`pip install 'springscale[archive]'` (pyarrow and obstore), which no vehicle needs.
"""

DATASET: Final = """\
## The data set

    DATASET/estimates/vehicle=van-17/month=2026-03/JOB.parquet    one row a batch
    DATASET/receipts/vehicle=van-17/month=2026-03/JOB.json        the table of the same name is whole
    DATASET/failed/vehicle=van-17/month=2026-03/NAME.json         what gave nothing, and why

A job is the drives of one vehicle in one month, in order. JOB is the hash of everything that its rows follow from: the
logs' own hashes, signal map, calibration, tares, settings, and the code that weighs. The same inputs make the same name
and the same bytes, on one computer or on a hundred, and what is there is never written again.

**Readers trust receipts only.** A table is written first, its receipt last, and the receipt only where there is none
(a conditional put). A table without a receipt is of a job that was killed, or of inputs that have changed since; it is
no part of the data set. Every row carries its `job`, so that one join keeps to the rule:

```sql
-- DuckDB
SELECT vehicle, month, count(*) AS batches, count(payload_kg) AS weighed, avg(payload_kg) AS payload_kg
FROM read_parquet('DATASET/estimates/**/*.parquet', hive_partitioning = true)
SEMI JOIN read_json('DATASET/receipts/**/*.json', columns = {job: 'VARCHAR'}) USING (job)
GROUP BY ALL ORDER BY ALL;
```

```python
import polars as pl
from gateway.archive import trusted_tables

drives = pl.scan_parquet(trusted_tables("DATASET"), hive_partitioning=True)
print(drives.group_by("vehicle", "month").agg(pl.col("payload_kg").mean(), pl.len()).collect())
```

`gateway.archive` lists what can be trusted: `trusted_tables` (files or URLs), `slots_done` and `rows_of` (one job's
rows), `receipts` and `failures` (what was read, and what could not be).
"""

SCHEMA: Final = """\
## Columns

Version {version} of the schema, told in each file's metadata (`springscale_schema`). Columns are only ever added, at
the end. Numbers are those that `springscale estimate --json` prints, digit for digit; unknown is null, never 0. Spectra
are left out for their size. The partitions `vehicle` and `month` (of the log's first frame, UTC) are columns too; a
batch that crosses midnight is in the month of the log in which it ended.

| column | type | meaning |
|---|---|---|
{rows}

What of a vehicle drifts is found batch by batch: `damper_front_ratio`, `damper_rear_ratio`, `delay_scale`,
`payload_mode_hz` and, with a roll rate, `roll_share_front`. Springs and tyres cannot be told from the load within one
batch, so no column claims to: what they have changed shows as `tension` and in `payload_drift_std_kg`.

[`springscale fleet-report DATASET`](fleet-report.md) makes pages of it: loads by week, refusals, drift, bad sensors.
"""


def archive_page() -> str:
    """The whole page as Markdown."""
    rows = "\n".join(f"| `{name}` | {TYPES[kind]} | {_meaning(name)} |" for name, kind in columns().items())
    return "\n".join([INTRODUCTION, DATASET, SCHEMA.format(version=SCHEMA_VERSION, rows=rows)])


def _meaning(column: str) -> str:
    """In the words of the estimate's own page."""
    if column in PROVENANCE:
        return PROVENANCE[column]
    if column in DIAGNOSTICS:
        return DIAGNOSTICS[column]
    if column == OVER_LIMIT:
        return "places of `weights` that bear more than their limit; empty where none is known to"
    one = next(field for field in FIELDS if column in (field.name, *field.columns))
    if column == one.name or len(one.columns) < 2:
        return one.description or ""
    if one.name == "weights":
        return "its standard deviation" if column.endswith("_std_kg") else "on the road, standing on level ground"
    return f"{'lower' if '_low95' in column else 'upper'} end of its 95 % interval"


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(PAGE, archive_page(), "gateway/archive")


if __name__ == "__main__":
    main()
