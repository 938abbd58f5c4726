"""The table of speeds: what is beside what, and which goals are met. No speed is asserted anywhere."""

import json

import pytest

from benchmarks.speed import meter, peers
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


@pytest.mark.parametrize(("seconds", "is_told"), [(0.034, False), (0.036, True)])
def test_a_missed_goal_is_explained(seconds: float, is_told: bool):
    batch, *_ = lines_of({"weigh": {"batch_s": {"cross_spectrum": seconds}, "calibration": {"cpu_s": 1.0}}})
    assert ("missed, held by" in batch.verdict) == is_told


def test_missing_libraries_are_left_out_and_named():
    figures = {line.what: line.figure for line in lines_of({"decode": DECODE})}
    assert figures["hilspy, by DBC"] == "left out: hilspy is not installed"
    assert figures["python-can + cantools"] == "5,000 ns a frame, 125 x ours"
    assert figures["wc -l"] == "7 ns a frame, 0.17 x ours"


def test_a_large_ratio_is_a_whole_number():
    row = {"springscale": {"ns_per_frame": 82.0, "peak_mb": 225.0}, "python-can": {"ns_per_frame": 10_000.0}}
    (line,) = lines_of({"formats": {"rows": {".mf4": row}}})
    assert line.figure == "82 ns a frame, 225 MB, 122 x python-can's reader"


def test_the_table_has_the_cost_of_a_parked_vehicle():
    idle = {"n_delivered": 1000, "processor_s_per_hour": 12.34, "disk_kb_per_hour": 1234.0}
    assert [line.figure for line in lines_of({"idle": idle})] == ["12.3 s an hour", "1,234 kB an hour"]
    (absent,) = lines_of({"idle": {"skipped": "mosquitto is not installed"}})
    assert absent.figure == "left out: mosquitto is not installed"


def test_parts_that_were_not_run_have_no_lines():
    assert lines_of({}) == []
    assert {line.section for line in lines_of({"simulator": {"stage": 3.0}})} == {"simulator"}


def test_a_run_names_its_missing_library(capsys):
    def run():
        raise ModuleNotFoundError("No module named 'hilspy'", name="hilspy")

    meter.print_answer(run)
    assert json.loads(capsys.readouterr().out) == {"skipped": "hilspy is not installed"}


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
