"""An archive's table says what `springscale estimate` prints, bit for bit, and what the live service would say."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from support.archive import MIDNIGHT_NS, WINDOW_S, Here, S, write_cut_drive, write_drive, write_manifest
from support.bus_drive import bus_drive
from support.commands import called
from support.paper_van import PAPER_VAN

from gateway.archive import place_of, rows_of, slots_done
from gateway.archive.dataset import PROVENANCE, row_of
from gateway.archive.manifest import load_manifest
from gateway.archive.reprocessing import reprocess
from gateway.bus.logs import write_candump

IDENTITY = ("id", "vehicle_id", *PROVENANCE)  # `estimate` on bare files knows neither vehicle nor archive


def reprocessed(folder: Path) -> list[dict[str, Any]]:
    """Every row, in order of time."""
    dataset = place_of(folder / "dataset")
    assert reprocess(load_manifest(str(folder)), dataset, Here()).is_good
    return sorted(
        (row for slot in slots_done(dataset) for row in rows_of(dataset, slot)), key=lambda row: row["t_end_ns"]
    )


def printed(calibration: Path, window_s: float, *logs: Path, options: Sequence[str] = ()) -> list[dict[str, Any]]:
    """The output of `springscale estimate --json`, as rows."""
    command = ["estimate", *map(str, logs), "--signals", "springscale:reference", "--calibration", str(calibration)]
    result = called(*command, "--window-s", window_s, "--json", *options)
    records = [json.loads(line) for line in result.stdout.splitlines()]
    assert result.exit_code == all(record["rejected"] for record in records), result.stderr
    return [row_of(record) for record in records]


def the_same(rows: Sequence[dict[str, Any]], told: Sequence[dict[str, Any]]) -> bool:
    """Every column that both have, the instants and the last bit of every number among them."""
    bare = [{name: cell for name, cell in row.items() if name not in (*IDENTITY, "shares")} for row in rows]
    asked = [{name: cell for name, cell in row.items() if name not in (*IDENTITY, "shares")} for row in told]
    shares = [dict(row["shares"]) for row in rows] == [dict(row["shares"]) for row in told]
    return bare == asked and shares


def test_logs_with_a_pause_between_them_are_drives_of_their_own(tmp_path: Path) -> None:
    write_drive(tmp_path / "van" / "1.log", MIDNIGHT_NS - 3600 * S, 45.0, seed=1)
    write_drive(tmp_path / "van" / "2.log.gz", MIDNIGHT_NS + 60 * S, 45.0, seed=2)
    write_manifest(tmp_path, "van")
    rows = reprocessed(tmp_path)
    told = printed(tmp_path / "vehicle.json", WINDOW_S, tmp_path / "van" / "1.log", tmp_path / "van" / "2.log.gz")
    assert len(rows) == 4  # the last 5 s of each are no batch
    assert the_same(rows, told)
    assert [row["payload_kg"] for row in rows] == [200.0] * 4
    assert [row["log"] for row in rows] == ["van/1.log"] * 2 + ["van/2.log.gz"] * 2


@pytest.mark.parametrize("cut_s", [-7, 0, 5], ids=["in the month before", "at midnight", "in the month after"])
def test_a_drive_may_span_logs_and_months(tmp_path: Path, cut_s: int) -> None:
    """Window, load epoch and drive are those of the whole recording, whichever job the log of a batch's end is in."""
    start_ns = MIDNIGHT_NS - 50 * S
    frames = write_cut_drive(tmp_path / "van", start_ns, 130.0, MIDNIGHT_NS + cut_s * S)
    write_candump(frames, "can0", tmp_path / "whole.log")
    write_manifest(tmp_path, "van")
    rows = reprocessed(tmp_path)
    assert the_same(rows, printed(tmp_path / "vehicle.json", WINDOW_S, tmp_path / "whole.log"))
    assert [row["epoch_n_batches"] for row in rows] == [1, 2, 3, 4, 5, 6]
    months = {slot.month for slot in slots_done(place_of(tmp_path / "dataset"))}
    assert months == ({"2026-10"} if cut_s < 0 else {"2026-10", "2026-11"})


def test_the_half_car_s_answers_are_the_same_bits(tmp_path: Path) -> None:
    (tmp_path / "van").mkdir()
    write_candump(bus_drive(130.0, seed=5), "can0", tmp_path / "van" / "1.log")
    write_manifest(tmp_path, f'id = "van"\ncalibration = "{PAPER_VAN}"\nestimator = "cross_spectrum"')
    text = (tmp_path / "archive.toml").read_text().replace(f"window_s = {WINDOW_S}", "window_s = 60.0")
    (tmp_path / "archive.toml").write_text(text)
    options = ("--estimator", "cross_spectrum")
    rows = reprocessed(tmp_path)
    assert the_same(rows, printed(PAPER_VAN, 60.0, tmp_path / "van" / "1.log", options=options))
    assert all(row["damper_front_ratio"] > 0.0 for row in rows[:2])
