"""The table of speeds: what is beside what, and which goals are met. No speed is asserted anywhere."""

import pytest

from benchmarks.speed import peers
from benchmarks.speed.__main__ import main
from benchmarks.speed.table import lines_of

DECODE = {
    "minutes": 1.0,
    "rows": {
        "springscale": {"ns_per_frame": 40.0, "peak_mb": 62.0},
        "wc -l": {"ns_per_frame": 7.0, "peak_mb": 5.0},
        "hilspy, by DBC": {"skipped": "hilspy is not installed"},
        "python-can + cantools": {"ns_per_frame": 5000.0, "peak_mb": 60.0},
    },
    "times_python_can": 125.0,
    "times_wc": 5.7,
}


def test_a_goal_is_met_or_missed():
    verdicts = {line.what: line.verdict for line in lines_of({"decode": DECODE})}
    assert verdicts["springscale"].startswith("at most 25 ns a frame: missed, held by finding line ends")
    assert verdicts["memory"] == "at most 150 MB: met"
    assert verdicts["wc -l"] == ""


def test_missing_libraries_are_left_out_and_named():
    figures = {line.what: line.figure for line in lines_of({"decode": DECODE})}
    assert figures["hilspy, by DBC"] == "left out: hilspy is not installed"
    assert figures["python-can + cantools"] == "5,000 ns a frame, 125 x ours"
    assert figures["wc -l"] == "7 ns a frame, 0.17 x ours"


@pytest.mark.parametrize("name", ["wc -l", "for line in file", "python-can + cantools"])
def test_every_path_finds_the_same_frames(name, tmp_path):
    ours = "(1627274455.{:06d}) can0 120#0011223344556601\n"
    other = "(1627274455.{:06d}) can0 18FEF100#0011223344556677\n"
    (tmp_path / "a.log").write_text("".join(ours.format(i) + other.format(i) for i in range(50)))
    found = peers.PEERS[name](tmp_path / "a.log")
    assert found["frames"] == 100
    assert found.get("samples", 50) == 50


def test_a_busy_machine_writes_no_figures(monkeypatch, tmp_path):
    monkeypatch.setattr("os.getloadavg", lambda: (1.2, 0.1, 0.1))
    monkeypatch.setattr("sys.argv", ["speed", "--only", "start", "--output", str(tmp_path / "found.json")])
    with pytest.raises(SystemExit, match=r"the load average is 1\.2"):
        main()
    assert not list(tmp_path.iterdir())
