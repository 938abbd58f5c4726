"""Tables of statements: what spreadsheets and planning software write is read; every row that cannot be is named."""

import json
from datetime import UTC, datetime
from zoneinfo import ZoneInfo

import pytest

from gateway.calibration.statements_csv import StatementsFileError, ToldRows, read_statements
from gateway.stated.statement import StatementSource

BERLIN = ZoneInfo("Europe/Berlin")
MORNING = datetime(2026, 11, 26, 7, 40, tzinfo=UTC)


def told(text: str | bytes, zone: ZoneInfo | None = None) -> ToldRows:
    content = text if isinstance(text, bytes) else text.encode()
    return read_statements(content, "notes.csv", zone)


def only_fault(found: ToldRows) -> str:
    assert not found.rows
    ((fault,),) = found.faults.values()
    return fault


def test_columns_are_read_by_their_names_in_any_order() -> None:
    found = told(
        "ref;payload_kg;plus_minus_kg;from;until;vehicle;source;behind_front_axle_m;place_plus_minus_m;left_m;carries\n"
        "LS-4711;310;25;2026-11-26T07:40:00Z;2026-11-26T12:00:00Z;Van 7;delivery_note;1.8;0.6;-0.1;parcels\n"
    )
    (row,) = found.rows
    record = row.record
    assert (row.number, row.vehicle, record.ref, record.source) == (
        2,
        "Van 7",
        "LS-4711",
        StatementSource.DELIVERY_NOTE,
    )
    assert (record.load.payload_kg, record.load.plus_minus_kg) == (310.0, 25.0)
    assert record.from_ == MORNING
    assert record.until == MORNING.replace(hour=12, minute=0)
    assert record.place is not None
    assert record.shape is not None
    assert (record.place.behind_front_axle_m, record.place.plus_minus_m, record.place.left_m) == (1.8, 0.6, -0.1)
    assert record.shape.carries == "parcels"
    assert not found.faults
    assert not found.notes


@pytest.mark.parametrize(
    "text",
    [
        "from,payload_kg\n2026-11-26T07:40:00Z,310\n",
        "from;payload_kg\n2026-11-26T07:40:00Z;310\n",
        "from\tpayload_kg\n2026-11-26T07:40:00Z\t310\n",
        "sep=;\nfrom;payload_kg\n2026-11-26T07:40:00Z;310\n",
        "\ufefffrom;payload_kg\r\n2026-11-26T07:40:00Z;310\r\n\r\n",
        "\n;;\nFrom;Payload kg;\n2026-11-26T07:40:00Z;310;\n",
        '"from","payload_kg"\n"2026-11-26T07:40:00Z","310 kg"\n',
        "from;payload_kg\n2026-11-26T07:40:00Z;310\n".encode("utf-16"),
    ],
    ids=["comma", "semicolon", "tab", "sep line", "byte order mark", "blank rows", "quoted, with unit", "UTF-16"],
)
def test_every_way_of_saving_a_table_gives_the_same_statement(text: str | bytes) -> None:
    (row,) = told(text).rows
    assert row.record.load.payload_kg == 310.0
    assert row.record.from_ == MORNING


@pytest.mark.parametrize(
    ("cell", "kg"),
    [("310", 310.0), ("310,5", 310.5), ("310.5", 310.5), ("1.240,5", 1240.5), ("1,240.5", 1240.5), ("1 240", 1240.0)],
)
def test_numbers_have_a_decimal_point_or_comma(cell: str, kg: float) -> None:
    (row,) = told(f"from;payload_kg\n2026-11-26T07:40:00Z;{cell}\n").rows
    assert row.record.load.payload_kg == kg


def test_thousands_and_decimals_are_decided_by_the_whole_file() -> None:
    german = told("from;payload_kg;plus_minus_kg\n2026-11-26T07:40:00Z;1.240;12,5\n")
    assert german.rows[0].record.load.payload_kg == 1240.0
    english = told("from;payload_kg;plus_minus_kg\n2026-11-26T07:40:00Z;1.240;12.5\n")
    assert english.rows[0].record.load.payload_kg == 1.24
    assert "a thousand or a fraction? write 1240 or 1.24" in only_fault(
        told("from;payload_kg\n2026-11-26T07:40:00Z;1.240\n")
    )


@pytest.mark.parametrize(
    "cell",
    ["2026-11-26 08:40", "2026-11-26T08:40:00", "26.11.2026 08:40", "26.11.26, 8:40 Uhr", "2026/11/26 08:40",
     "26/11/2026 08:40", "11/26/2026 8:40 AM", "2026-11-26T07:40Z", "2026-11-26T08:40+01:00"],
)  # fmt: skip
def test_times_are_read_as_people_write_them_in_the_stated_zone(cell: str) -> None:
    (row,) = told(f"from;payload_kg\n{cell};310\n", BERLIN).rows
    assert row.record.from_ == MORNING


def test_times_without_a_zone_are_read_as_utc_with_a_note() -> None:
    found = told("from;payload_kg\n2026-11-26 07:40;310\n")
    assert found.rows[0].record.from_ == MORNING
    assert found.notes == (
        "times without a zone are read as UTC; if that is wrong, state --timezone, such as Europe/Berlin",
    )


def test_an_end_date_includes_the_whole_day() -> None:
    (row,) = told("from;until;payload_kg\n26.11.2026;26.11.2026;310\n", BERLIN).rows
    assert row.record.until is not None
    assert (row.record.until - row.record.from_).total_seconds() == 86_400.0


@pytest.mark.parametrize(
    ("cells", "source"),
    [
        (";;310;", StatementSource.DELIVERY_NOTE),
        (";;0;", StatementSource.EMPTY),
        ("1890;;;", StatementSource.SCALE),
        (";900;;990", StatementSource.AXLE_SCALES),
    ],
)
def test_a_row_without_a_source_has_the_one_that_its_load_suggests(cells: str, source: StatementSource) -> None:
    (row,) = told(f"from;gross_kg;front_axle_kg;payload_kg;rear_axle_kg\n2026-11-26T07:40:00Z;{cells}\n").rows
    assert row.record.source is source


def test_empty_needs_no_load() -> None:
    (row,) = told("from;source\n2026-11-26T07:40:00Z;empty\n").rows
    assert row.record.load.payload_kg == 0.0


@pytest.mark.parametrize(
    ("header", "cells", "fault"),
    [
        ("from;payload_kg", "yesterday;310", "row 2: from: yesterday: no time; write it as 2026-11-26 07:40"),
        ("from;payload_kg", "46352;310", "row 2: from: 46352: a bare number: format the column as date and time"),
        ("from;payload_kg", "03/04/2026 07:40;310", "row 2: from: 03/04/2026 07:40: day or month first?"),
        ("from;payload_kg", ";310", "row 2: from: missing: write the time from which it holds"),
        ("from;payload_kg", "2026-11-26T07:40Z;heavy", "row 2: payload_kg: heavy: not a number: write it in kg"),
        ("from;payload_kg", "2026-11-26T07:40Z;700 lbs", "row 2: payload_kg: 700 lbs: is in lbs: write it in kg"),
        ("from;payload_kg", "2026-11-26T07:40Z;0.31 t", "row 2: payload_kg: 0.31 t"),
        ("from;payload_kg", "2026-11-26T07:40Z;-310", "row 2: payload_kg: "),
        ("from;payload_kg", "2026-11-26T07:40Z;", "row 2: says no load: fill one of payload_kg"),
        ("from;payload_kg", "1926-11-26T07:40Z;310", "row 2: from: 1926-11-26T07:40Z: not a year of a drive"),
        ("from;payload_kg", "2026-11-26T07:40Z;310;7", "row 2: has 3 cells, the header names 2"),
        ("from;until;payload_kg", "2026-11-26T07:40Z;2026-11-25T07:40Z;310", "row 2: until is not after from"),
        ("from;payload_kg;gross_kg", "2026-11-26T07:40Z;310;1890", "says the load twice"),
        ("from;front_axle_kg", "2026-11-26T07:40Z;900", "front_axle_kg and rear_axle_kg belong together"),
        ("from;source;payload_kg", "2026-11-26T07:40Z;scales;310", "row 2: source: scales: did you mean scale?"),
        ("from;source;payload_kg", "2026-11-26T07:40Z;empty;310", "source empty with a load"),
        ("from;payload_kg;learn", "2026-11-26T07:40Z;310;maybe", "row 2: learn: maybe: write one of true, false"),
    ],
)  # fmt: skip
def test_a_row_that_cannot_be_read_is_named_with_its_column_and_how_to_mend_it(
    header: str, cells: str, fault: str
) -> None:
    found = told(f"{header}\n{cells}\n")
    assert fault in only_fault(found)


@pytest.mark.parametrize(
    ("local", "why"),
    [
        ("2026-10-25 02:30", "occurs twice when clocks change"),
        ("2026-03-29 02:30", "does not exist when clocks change"),
    ],
)
def test_an_hour_that_summer_time_repeats_or_skips_is_asked_about(local: str, why: str) -> None:
    assert why in only_fault(told(f"from;payload_kg\n{local};310\n", BERLIN))


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (b"", "holds no row"),
        (b"a;b\n1;2\n", "names no column of a statement"),
        (b"payload_kg;ref\n310;x\n", "no column from"),
        (b"from;ref\n2026-11-26;x\n", "no column with a load"),
        (b"from;payload\n2026-11-26T07:40Z;310\n", "unknown column payload: did you mean payload_kg?"),
        (b"from;payload_kg;payload_kg\n2026-11-26;1;2\n", "column payload_kg is there 2 times"),
        (b"PK\x03\x04\x00\x00", "save the table as CSV"),
        (b"[{]", "not valid JSON"),
    ],
)
def test_a_file_that_is_no_table_of_statements_is_refused_with_a_remedy(content: bytes, why: str) -> None:
    with pytest.raises(StatementsFileError, match=r"notes\.csv: ") as refused:
        told(content)
    assert why in str(refused.value)


def test_json_of_the_service_and_csv_give_the_same_statements() -> None:
    csv = told("ref;from;payload_kg;plus_minus_kg\nLS-1;2026-11-26T07:40:00Z;310;25\n").rows[0].record
    answer = csv.model_dump_json(by_alias=True)
    (row,) = told(f'{{"items": [{answer}]}}').rows
    assert row.record == csv


def test_withdrawn_statements_are_left_out() -> None:
    listed = [
        {"from": "2026-11-26T07:40:00Z", "source": "empty", "state": state, "ref": state}
        for state in ("used", "withdrawn")
    ]
    found = told(json.dumps({"items": listed}))
    assert [row.record.ref for row in found.rows] == ["used"]
    assert found.n_rows == 1
