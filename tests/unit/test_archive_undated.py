"""A log without a date belongs to no month and no calibration's span: the archive refuses it by name."""

import pytest
from support.archive import Here, write_drive, write_manifest

from gateway.archive import place_of
from gateway.archive.manifest import load_manifest
from gateway.archive.reprocessing import reprocess


@pytest.mark.parametrize("span", ["", "\nuntil = 2026-01-01", "\nsince = 2026-01-01"])
def test_an_undated_log_is_refused_and_named_whatever_the_span(span, tmp_path):
    write_drive(tmp_path / "van-1" / "1.log", 0, 3.0)
    manifest = write_manifest(tmp_path, f'id = "van-1"{span}')
    summary = reprocess(load_manifest(str(manifest)), place_of(tmp_path / "out"), Here())
    assert not summary.is_good
    assert [reason for outcome in summary.outcomes for reason in outcome.failures] == [
        "van-1/1.log: has no date: nothing tells which month and calibration it belongs to; "
        "weigh it with springscale estimate"
    ]
