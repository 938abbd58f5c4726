"""The table of an archive: what an estimate says, column by column, and only what receipts vouch for."""

import io
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import duckdb
import polars as pl
from support.estimates import make_record, with_everything

from gateway.archive import Slot, place_of, receipts, rows_of, slots_done, trusted_tables
from gateway.archive.dataset import PROVENANCE, columns, parquet_of, row_of
from gateway.archive.receipts import text_of
from gateway.estimates.as_json import COLUMNS, FIELDS, estimate_to_json
from gateway.records import Why

TOLD = dict.fromkeys(PROVENANCE, "x")
SLOT = Slot("van-17", "2026-03", "abc")


def kept(dataset: Path, slot: Slot, *records: dict[str, object]) -> None:
    """A table as a job writes it, with its receipt."""
    place = place_of(dataset)
    place.create(slot.table, parquet_of([{**row_of(record), **TOLD, "job": slot.job} for record in records]))
    place.create(slot.receipt, text_of({"job": slot.job}))


def test_every_field_of_an_estimate_is_a_column_but_its_spectra() -> None:
    names = list(columns())
    assert set(COLUMNS) <= set(names)
    left_out = "spectra provisional diagnostics way error_budget posterior epoch_posterior"
    assert {one.name for one in FIELDS if not one.columns} - set(names) == set(left_out.split())
    assert names[-len(PROVENANCE) :] == list(PROVENANCE)


def test_a_row_read_back_is_the_estimate_as_it_is_printed() -> None:
    record = estimate_to_json(with_everything(3))
    [row] = pl.read_parquet(parquet_of([{**row_of(record), **TOLD}])).to_dicts()
    for one in FIELDS:
        if one.name in row and one.name not in ("t_start", "t_end", "shares"):
            assert row[one.name] == record.get(one.name), one.name
    assert row["t_end"] == datetime(1970, 1, 1, 0, 20, tzinfo=UTC)
    assert (row["payload_low95_kg"], row["payload_high95_kg"]) == tuple(record["payload_interval95_kg"])
    assert {one["key"]: one["value"] for one in row["shares"]} == record["shares"]
    assert row["damper_front_ratio"] == record["diagnostics"]["damper_front_ratio"]
    assert row["gross_kg"] == record["weights"]["gross"]["kg"]
    assert row["over_limit"] == ["front_axle"]


def test_unknown_is_null_and_never_zero() -> None:
    row = row_of(make_record(0, Why.GAP))
    assert row["rejected"] == ["gap"]
    assert row["payload_kg"] is row["payload_low95_kg"] is row["epoch_n_batches"] is None


def test_the_same_rows_make_the_same_bytes_and_the_schema_its_version() -> None:
    rows = [{**row_of(make_record(n)), **TOLD} for n in range(3)]
    assert parquet_of(rows) == parquet_of(rows)
    assert pl.read_parquet_metadata(io.BytesIO(parquet_of([])))["springscale_schema"] == "1"
    assert columns() == pl.read_parquet_schema(io.BytesIO(parquet_of(rows)))


def test_readers_trust_receipts_only(tmp_path: Path) -> None:
    kept(tmp_path, SLOT, make_record(0), make_record(1, Why.GAP))
    without_receipt = replace(SLOT, job="killed")
    place = place_of(tmp_path)
    place.create(without_receipt.table, parquet_of([{**row_of(make_record(2)), **TOLD, "job": "killed"}]))
    assert slots_done(place) == [SLOT]
    assert [told["job"] for told in receipts(tmp_path)] == ["abc"]
    assert [row["payload_kg"] for row in rows_of(place, SLOT, ["payload_kg"])] == [100.0, None]


def test_the_documented_queries_read_it(tmp_path: Path) -> None:
    kept(tmp_path, SLOT, make_record(0), make_record(1, Why.GAP))
    place_of(tmp_path).create(replace(SLOT, job="killed").table, parquet_of([{**row_of(make_record(2)), **TOLD}]))
    documented = (Path(__file__).parents[2] / "docs" / "archive.md").read_text(encoding="utf-8")
    sql = documented.partition("```sql")[2].partition("```")[0].replace("DATASET", str(tmp_path))
    assert duckdb.sql(sql).fetchall() == [("van-17", "2026-03", 2, 1, 100.0)]
    lazy = pl.scan_parquet(trusted_tables(tmp_path), hive_partitioning=True)
    found = lazy.group_by("vehicle", "month").agg(pl.col("payload_kg").mean(), pl.len()).collect()
    assert found.rows() == [("van-17", "2026-03", 100.0, 2)]
