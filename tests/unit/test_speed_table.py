"""The table of speeds: every path reads the same frames, and a busy machine writes none. No speed is asserted."""

import pytest

from benchmarks.speed import peers
from benchmarks.speed.__main__ import main


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
