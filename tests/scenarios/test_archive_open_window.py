"""A window is open where a log ends, and the log that would go on with it cannot be used."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.archive import MIDNIGHT_NS, Here, S, write_cut_drive, write_manifest

from gateway.archive import failures, place_of, rows_of, slots_done
from gateway.archive.manifest import load_manifest
from gateway.archive.reprocessing import Summary, reprocess
from gateway.bus.logs import motion_of_log
from gateway.bus.signals import SignalMap
from gateway.records import Motion, joined


def done(archive: Path) -> Summary:
    return reprocess(load_manifest(str(archive)), place_of(archive / "dataset"), Here())


def rows_in(archive: Path) -> list[dict[str, Any]]:
    """The rows in order of time, without the job's name."""
    dataset = place_of(archive / "dataset")
    rows = (row | {"job": None} for slot in slots_done(dataset) for row in rows_of(dataset, slot))
    return sorted(rows, key=lambda row: row["t_end_ns"])


def reader_that_trips_in(name: str) -> Any:
    """Over one log, a window after its beginning."""

    def read(path: Path, signal_map: SignalMap) -> Any:
        motions, report = motion_of_log(path, signal_map)
        return (cut(joined(list(motions))) if path.name == name else motions), report

    def cut(motion: Motion) -> Iterator[Motion]:
        yield motion.rows(motion.t_ns < motion.t_ns[0] + 20 * S)
        raise ValueError("bytes that nobody expected")

    return read


@pytest.mark.parametrize("begin_ns", [MIDNIGHT_NS + 60 * S, MIDNIGHT_NS - 40 * S], ids=["in a month", "over midnight"])
@pytest.mark.parametrize("fault", ["of another vehicle", "trips its reader"])
def test_the_log_before_is_weighed_to_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begin_ns: int, fault: str
) -> None:
    """As where no log follows, whatever of the bad one was read until then."""
    second = tmp_path / "van" / "2.log"
    write_cut_drive(tmp_path / "van", begin_ns, 75.0, begin_ns + 119 * S // 2)
    write_manifest(tmp_path, "van")
    content = second.read_text()
    second.unlink()
    assert done(tmp_path).is_good
    alone = rows_in(tmp_path)
    assert [(row["log"], row["rejected"]) for row in alone] == [("van/1.log", [])] * 3
    shutil.rmtree(tmp_path / "dataset")

    if fault == "trips its reader":
        second.write_text(content)
        monkeypatch.setattr("gateway.archive.drives.motion_of_log", reader_that_trips_in("2.log"))
    else:
        second.write_text(re.sub(r"can0 \w+#", "can0 7A1#", content))
    assert done(tmp_path).n_failed_logs == 1
    assert [failure["log"] for failure in failures(tmp_path / "dataset")] == ["van/2.log"]
    assert rows_in(tmp_path) == alone
