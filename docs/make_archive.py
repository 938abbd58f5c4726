"""Writes docs/archive.md from gateway/archive; with --check only tells whether it is up to date."""

from pathlib import Path
from typing import Final

from generated import keep_up_to_date, key_table
from make_estimate import DIAGNOSTICS

from gateway.archive.dataset import OVER_LIMIT, OWN_STD, PROVENANCE, SCHEMA_VERSION, columns
from gateway.archive.manifest import ManifestFile, VehicleEntry
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

Whenever a method, a calibration or a limit has changed, the logs of a whole fleet are weighed anew, into one data set
of Parquet files that DuckDB, polars and pandas read:

    springscale reprocess ARCHIVE --output DATASET --dry-run    # how much there is, and how long it will take
    springscale reprocess ARCHIVE --output DATASET

ARCHIVE is a manifest, or a folder with an `archive.toml` or `archive.parquet` in it. Both may lie on this computer or
in an object store. This wants `pip install '.[archive]'` in a checkout ([elsewhere](deployment.md#install)): pyarrow
and obstore, which no vehicle needs.
"""

MANIFEST: Final = """\
## The manifest

It tells whose logs lie where, and what they are weighed by. Paths are relative to it; so are the databases of a signal
map to that.

```toml
signals = "signals.toml"                # or springscale:NAME; for every vehicle that names no other
logs = "s3://fleet-logs/2026"           # the vehicles' folders are below; without it, beside the manifest
batch.window_s = 300.0                  # any key of [batch] in the settings

[[vehicles]]
id = "van-17"                           # its logs are in s3://fleet-logs/2026/van-17, and below
vin = "WF0XXXTTGXJK12345"
calibration = "van-17/vehicle.json"
known_weights = "van-17/known_weights.json"  # as its gateway keeps it
until = 2026-06-12                      # the day on which its springs were changed

[[vehicles]]
id = "van-17"
vin = "WF0XXXTTGXJK12345"
calibration = "van-17/after_repair.json"
since = 2026-06-12

[[vehicles]]
vin = "WF0XXXTTGXJK12346"               # without an id the VIN is its name, and its folder's
calibration = "van-18/vehicle.json"
estimator = "ratio_index"
```

Instead of `[[vehicles]]`, `vehicles_in = "fleet.parquet"` names a Parquet file with one row for each, its columns named
as the keys; and a manifest may be such a file alone. An unknown key, a vehicle or folder that is given twice for one
instant, or a file that cannot be loaded is an error that says where.

{top}
`[batch]` and `[trust]` are those of the [settings](settings.md): with keys there, signal maps, databases and
calibrations must be [signed](security.md#signed-files) by one of them; with `reprocess --trusted-keys FILE` the
manifest too.

### [[vehicles]]

{vehicles}
"""

RUNNING: Final = """\
## A run

First every log that is new is looked into: its hash, and the instant of its first frame. Then its jobs are done, one
function from a job to a receipt, on all cores of this computer, each process with one thread. The terminal shows how
much is done, the rate, and the time that is left. What comes back from a job is a small summary; logs are read as
streams, and one in an object store is copied to the worker's disk (`TMPDIR`), in chunks, for as long as it is read.

- **Stop it, and run it again**: what has a receipt is not done again. A second run over the same logs writes nothing.
- **A log that cannot be read** is told under `failed/` with the reason, and the rest goes on without it: a drive that
  was under way before it ends where the log before it ended. The command ends with 1, once; nothing else can be made of
  the same bytes.
- **A worker that is killed** costs the job it was doing, which another one does. A job over which workers die three
  times is told under `failed/`; `--retry-failed` tries such jobs again.
- **A store that does not answer** leaves its jobs undone, and the command ends with 1: run it again. A vehicle of which
  one log is out of reach is not weighed without it.
- **New logs, another calibration, another version** change the hash of the jobs that they concern. These are done, and
  when all of a vehicle's month are, the receipts of the old ones are taken back. Tables stay. So a data set belongs to
  one manifest; to compare two calibrations, write two data sets. Months and vehicles whose logs are gone stay as they
  were.

Exit codes are 0 when everything is done, 1 when something failed or was left undone, 2 for a mistake in the manifest or
the options. `--json` prints one object for machines.

### Where archive and data set may lie

| place | written as | credentials |
|---|---|---|
| this computer | a path, or `file:///...` | |
| Amazon S3 | `s3://BUCKET/FOLDER` | `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`, or a role there |
| Google Cloud Storage | `gs://BUCKET/FOLDER` | `GOOGLE_APPLICATION_CREDENTIALS` |
| Azure Blob Storage | `az://CONTAINER/FOLDER` | `AZURE_STORAGE_ACCOUNT_NAME`, `AZURE_STORAGE_ACCOUNT_KEY` |

They are read from the environment of every process, workers' included. `AWS_ENDPOINT_URL` names another server that
speaks S3's protocol, `AZURE_ENDPOINT` one that speaks Azure's (`http://HOST/ACCOUNT`); for Google's,
`GOOGLE_SERVICE_ACCOUNT` names a JSON file with `"gcs_base_url"`, and `"disable_oauth": true` where nobody asks for a
key. `AWS_ALLOW_HTTP=true`, and likewise `AZURE_` and `GOOGLE_`, let them do so without TLS.

A store must refuse a conditional write where something is. Tests run against folders and against S3's protocol. Azure
was tried by hand against Microsoft's emulator (Azurite), Google against fake-gcs-server: the same bytes as in a folder,
a second run writes nothing, and the conditional write is refused. That emulator has no upload by the XML protocol that
obstore speaks, so a small proxy turned each into the JSON one, its condition along; at Google itself it was not tried.

### On many computers

    pip install '.[cluster]'                                             # everywhere, of the same checkout
    dask scheduler                                                       # on one of them
    dask worker tcp://SCHEDULER:8786 --nthreads 1 --nworkers auto        # on each
    springscale reprocess s3://fleet/archive --output s3://fleet/estimates --scheduler tcp://SCHEDULER:8786

Archive and data set must be places that every worker reaches; signal maps, calibrations and known weights travel with
the jobs. A worker with another version of the code refuses its job, and the run ends saying so.

## What a job is

The drives of one vehicle in one month (of a log's first frame, UTC), in order of their frames, by one calibration.

- **A log that goes on where the one before it ended** (within `silence_s` of its last mapped frame) goes on: batch,
  drive and load epoch are those of the whole recording, as live, over midnight and the ends of months. The numbers are
  those of `springscale estimate` on the two logs joined.
- **Any other log begins anew**, as a gateway does that starts with the ignition: the numbers are those of
  `springscale estimate` on that log, bit for bit.
- **At the beginning of a month** a job finds its state by reading the vehicle's logs of the 25 hours before, if the
  last of them is still under way; a drive that began earlier is taken to begin there. The batch that crosses the border
  is in the month of the log in which it ended.
- **A known weight counts while it was in use**: from the batch after the instant `at` (of one that was held: of its
  confirmation) to the instant at which it was taken back, by the history in `known_weights.json`.
  (`springscale estimate --known-weights` applies those that are in use now.)
- **A change of calibration** (`since`, `until`) parts a month into jobs, by the first frames of logs; nothing goes on
  from one calibration to the other.
"""

DATASET: Final = """\
## The data set

    DATASET/estimates/vehicle=van-17/month=2026-03/JOB.parquet    one row a batch
    DATASET/receipts/vehicle=van-17/month=2026-03/JOB.json        the table of the same name is whole
    DATASET/failed/vehicle=van-17/month=2026-03/NAME.json         what gave nothing, and why
    DATASET/logs/vehicle=van-17.json                              each log's hash and the instant of its first frame

A job is the drives of one vehicle in one month, in order. JOB is the hash of everything that its rows follow from: the
logs' own hashes, signal map, calibration, known weights, settings, and the code that weighs. The same inputs make the
same name and the same bytes, on one computer or on a hundred, and what is there is never written again.

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
    manifest = MANIFEST.format(
        top=key_table(ManifestFile, "vehicles", "batch", "trust"), vehicles=key_table(VehicleEntry)
    )
    return "\n".join([INTRODUCTION, manifest, RUNNING, DATASET, SCHEMA.format(version=SCHEMA_VERSION, rows=rows)])


def _meaning(column: str) -> str:
    """In the words of the estimate's own page."""
    others = {**PROVENANCE, **DIAGNOSTICS, **{name: words for name, (_, words) in OWN_STD.items()}}
    if column in others:
        return others[column]
    if column == OVER_LIMIT:
        return "places of `weights` that bear more than their limit; empty where none is known to"
    one = next(field for field in FIELDS if column in (field.name, *field.columns))
    if column == one.name or len(one.columns) < 2:
        return one.description or ""
    if one.name == "weights":
        of_weights = {"_std_kg": "its standard deviation", "_limit_kg": "what it may be"}
        return next((words for end, words in of_weights.items() if column.endswith(end)), one.description or "")
    return f"{'lower' if '_low95' in column else 'upper'} end of its 95 % interval"


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(PAGE, archive_page(), "gateway/archive")


if __name__ == "__main__":
    main()
