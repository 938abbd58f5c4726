"""Tables of statements of any content: every row is read or named, without a traceback, a hang or much memory."""

from typing import Final

import pytest
from hypothesis import HealthCheck, example, given, settings
from support.spoiled import Change, changed, changes, refusal_of

from gateway.calibration.statements_csv import StatementsFileError, ToldRows, read_statements
from gateway.records import json_line

N_FILES: Final = 500  # of each kind
TABLE: Final = """vehicle;ref;from;until;source;payload_kg;gross_kg;change_kg;plus_minus_kg;carries;learn;note
Van 7;LS-4711;2026-11-26T07:40:00Z;;delivery_note;310,5;;;25;parcels;true;"ten, by hand"
Van 7;LS-4712;26.11.2026 09:10;26.11.2026 11:00;scale;;1.890,0;;10;;ja;
Van 8;;2026-11-27;;empty;;;;;;;
Van 7;LS-4713;2026-11-27 08:00;;;;;-120;30;;;half of it
"""
CONTENTS: Final = {
    "semicolons": TABLE.encode(),
    "commas": b"from,payload_kg,ref\n2026-11-26T07:40Z,310,A\n11/26/2026 8:40 AM,120.5,B\n",
    "UTF-16": TABLE.encode("utf-16"),
    "JSON": b'{"items": [{"from": "2026-11-26T07:40:00Z", "source": "scale", "load": {"gross_kg": 1890}, "by": "x"}]}',
}
WORDS: Final = [
    *b"31.02.2026 2026-13-01 25:61 1.240 1,240 1.2.3 --5 12:00 NaN inf 1e308 kg lbs t empty ja maybe".split(),
    *(b"sep=|\n", b'"', b'""', b"\r", b"\r\n\r\n", b";;;;;;;;;;;;;;", b"from", b"payload_kg", b"=1+1", b"{}", b"null"),
]


@pytest.mark.parametrize("kind", CONTENTS)
@settings(max_examples=N_FILES, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(where=changes(WORDS))
@example(where=[(0, False, 1 << 20, b"[" * 100_000)])
@example(where=[(0, False, 0, b'"' + b"x" * 200_000)])
@example(where=[(0, False, 1 << 20, b'{"items": {"items": 1}}')])
@example(where=[(0, False, 1 << 20, b"from;payload_kg\n" + b"2026-11-26T07:40Z;310\n" * 3_000)])
def test_a_table_of_any_content_is_read_or_refused_in_words(kind: str, where: list[Change]) -> None:
    found: list[ToldRows] = []
    content = changed(CONTENTS[kind], where)
    refused = refusal_of(StatementsFileError, lambda: found.append(read_statements(content, "notes.csv")))
    if refused is not None:
        assert refused.startswith("notes.csv: ")
        assert len(refused) < 5_000
        return
    (told,) = found
    assert told.n_rows == len(told.rows) + len(told.faults)
    assert not {row.number for row in told.rows} & set(told.faults)
    for number, faults in told.faults.items():
        assert faults
        assert all(fault.startswith(f"row {number}: ") for fault in faults)
    json_line([row.record.model_dump(mode="json", by_alias=True) for row in told.rows])
