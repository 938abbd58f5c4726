"""springscale simulate, replay and reproduce, as a person calls them."""

import json
from pathlib import Path

import can
import pytest
from support.commands import called, run

from gateway.bus.logs import motion_of_log
from gateway.bus.signals import load_signal_map
from gateway.calibration.campaign_file import load_campaign
from gateway.cli import main
from gateway.cli import reproduce as reproduce_command
from gateway.cli.progress import StatusLine, counted
from gateway.reports.paper.experiments import Extent

LINE = "({t:.6f}) can1 101#0102030405060708\n"


def exit_of(*arguments: str) -> int | str | None:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return ended.value.code


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "a.log"
    path.write_text(
        "".join(LINE.format(t=100.0 + i) for i in range(3)) + "(103.000000) can1 101#012\n(104.000000) can2 102#00\n"
    )
    return path


def test_a_campaign_is_simulated_and_can_be_loaded(tmp_path: Path) -> None:
    done = run("simulate", "campaign", "load-sweep", str(tmp_path / "sweep"), "--longest-s", "3", "--json")
    told = json.loads(done.stdout)
    assert told["n_drives"] == len(load_campaign(Path(told["campaign"])).runs) == 10


def test_the_options_of_a_campaign_reach_the_simulator(tmp_path: Path) -> None:
    options = ("--vehicle", "large_van", "--map", "j1939", "--seed", "7", "--longest-s", "2", "--unrelated", "5")
    done = run("simulate", "campaign", "test1", str(tmp_path), *options)
    assert done.stdout.strip() == str(tmp_path / "campaign.toml")
    assert load_campaign(tmp_path / "campaign.toml").vehicle.name == "large_van"
    signal_map = load_signal_map(tmp_path / "signals.toml")
    assert signal_map.j1939
    motion, report = motion_of_log(next(tmp_path.rglob("can.log.gz")), signal_map)
    assert sum(len(rows) for rows in motion) == report.wanted < report.frames


def test_a_stream_sends_the_drives_to_a_bus() -> None:
    arguments = ("stream", "load-sweep", "--longest-s", "0.2", "--interface", "virtual", "--channel", "cli-stream")
    with can.Bus(interface="virtual", channel="cli-stream", ignore_config=True) as bus:
        done = run("simulate", *arguments, "--speed", "max", "--json")
        n_received = 0
        while bus.recv(0.0) is not None:
            n_received += 1
    assert json.loads(done.stdout) == {"sent": n_received}
    assert n_received > 100


def test_a_replay_tells_what_was_sent_and_what_could_not_be_read(log: Path) -> None:
    where = ("--interface", "virtual", "--channel", "cli-replay", "--from-channel", "can1", "--speed", "max")
    with can.Bus(interface="virtual", channel="cli-replay", ignore_config=True) as bus:
        for_machines = json.loads(run("replay", str(log), *where, "--json").stdout)
        received = [bus.recv(0.0) for _ in range(for_machines["sent"])]
        assert bus.recv(0.0) is None
    assert [message.arbitration_id for message in received] == [0x101] * 3
    assert for_machines["other_channel"] == 1
    assert for_machines["rejects"] == {"half_byte": {"count": 1, "first_lines": [4]}}
    for_people = run("replay", str(log), *where).stdout
    assert "3 frames sent" in for_people
    assert "left out: 1 frame of other channels" in for_people
    assert "left out, half byte: 1, first in line 4" in for_people


def test_the_speed_paces_the_replay(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    speeds = []
    monkeypatch.setattr("gateway.bus.sink.replay_frames", lambda chunks, sink, speed, *_: speeds.append(speed))
    for speed in ("2.5", "max"):
        called("replay", log, "--interface", "virtual", "--channel", "cli-pace", "--speed", speed)
    assert speeds == [2.5, "max"]


@pytest.mark.parametrize(
    ("arguments", "code", "complaint"),
    [
        (["--from-channel", "can7"], 1, "no frame of can7; --from-channel may name can1, can2"),
        (["--interface", "no-such"], 1, "no-such"),
        (["--speed", "0"], 2, "neither a number above 0 nor max"),
        (["--speed", "fast"], 2, "neither a number above 0 nor max"),
        (["--speed", "nan"], 2, "neither a number above 0 nor max"),
    ],
)
def test_a_log_that_cannot_be_replayed_is_reported_in_one_line(
    log: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], code: int, complaint: str
) -> None:
    assert exit_of("replay", str(log), "--interface", "virtual", "--channel", "cli-bad", *arguments) == code
    told = capsys.readouterr()
    assert complaint in told.err
    assert "Traceback" not in told.err
    assert told.out == ""


def test_usage_faults_exit_with_2_and_failed_work_with_1(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "campaign.toml").write_text("mine")
    assert exit_of("simulate", "campaign", "ident", str(tmp_path)) == 2
    assert "there is a campaign already" in capsys.readouterr().err
    assert exit_of("simulate", "campaign", "tset1", str(tmp_path)) == 2
    assert exit_of("simulate", "stream", "ident", "--interface", "no-such", "--channel", "x") == 1
    assert exit_of("replay", str(tmp_path / "none.log"), "--interface", "virtual", "--channel", "x") == 1
    assert exit_of("replay", str(tmp_path / "none.log")) == 2
    (tmp_path / "campaigns").mkdir()
    assert exit_of("reproduce", "--output", str(tmp_path)) == 2
    assert "there is a reproduction already" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "extent"),
    [
        (("--seed", "4"), Extent(seed=4)),
        (("--quick", "--workers", "2"), Extent(seed=1, window_s=100.0, longest_s=155.0, workers=2)),
    ],
)
def test_reproduce_drives_what_was_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: tuple[str, ...], extent: Extent
) -> None:
    asked = []

    def written(output: Path, extent: Extent, on_step: object) -> Path:
        asked.append((output, extent))
        return output / "report.html"

    monkeypatch.setattr(reproduce_command, "write_report", written)
    done = run("reproduce", "--output", str(tmp_path / "new"), *options, "--json")
    assert asked == [(tmp_path / "new", extent)]
    assert json.loads(done.stdout)["report"] == str(tmp_path / "new" / "report.html")


def test_no_progress_is_printed_without_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with counted("working") as on_step:
        on_step(2, 2)
    with StatusLine() as status:
        status.show("half way")
    told = capsys.readouterr()
    assert (told.out, told.err) == ("", "")


def test_progress_is_seen_at_a_terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with counted("working") as on_step:
        on_step(1, 2)
    with StatusLine() as status:
        status.show("half way")
        status.show("too soon to be shown")
    told = capsys.readouterr()
    assert told.out == ""
    assert "working" in told.err
    assert "half way" in told.err
    assert "too soon" not in told.err
