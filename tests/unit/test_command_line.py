"""The command line beside any one command: version, mistyped names and numbers, what a start does not import."""

import errno
import re
import sys
from pathlib import Path

import click
import pytest
from support.commands import called, ended, run

import gateway.cli
from gateway.cli import INTERRUPTED
from gateway.errors import SpringscaleError


@pytest.mark.parametrize(("typed", "meant"), [("estmate", "estimate"), ("check_config", "check-config")])
def test_a_mistyped_command_gets_a_suggestion(typed: str, meant: str) -> None:
    said = called(typed)
    assert said.exit_code == 2
    assert f"No such command {typed!r}: did you mean {meant}?" in said.output


def test_ctrl_c_ends_quietly_with_the_code_of_an_interrupted_process(monkeypatch: pytest.MonkeyPatch) -> None:
    @click.command()
    def stopped() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(gateway.cli._Lazy, "get_command", lambda self, ctx, name: stopped)
    said = called("run")
    assert said.exit_code == INTERRUPTED
    assert said.output == ""


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "a file or the output: No space left on device"),
        (FileNotFoundError(errno.ENOENT, "No such file or directory", "a.log"), "a.log: No such file or directory"),
    ],
)
def test_what_the_system_refuses_is_told_in_one_line(
    fault: OSError, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A full disk behind `> file` ended every command in a traceback."""

    @click.command()
    def refused() -> None:
        raise fault

    monkeypatch.setattr(gateway.cli._Lazy, "get_command", lambda self, ctx, name: refused)
    with pytest.raises(SystemExit) as ending:
        gateway.cli.main(["look"])
    assert ending.value.code == 1
    assert capsys.readouterr().err == f"springscale: {said}\n"


@pytest.mark.parametrize("text", ["nan", "inf", "-inf", "much"])
@pytest.mark.parametrize(
    "command",
    [
        ("estimate", "drive.log", "--signals", "springscale:reference", "--window-s"),
        ("demo", "--once", "--speed"),
        ("record", "a.log", "--signals", "x", "--interface", "virtual", "--channel", "x", "--for-s"),
        ("simulate", "campaign", "paper", "somewhere", "--longest-s"),
        ("state", "scale", "--gross"),
        ("state", "note", "310", "--plus-minus"),
    ],
)
def test_text_in_place_of_a_number_is_a_usage_error(command: tuple[str, ...], text: str) -> None:
    said = called(*command, text)
    assert said.exit_code == 2
    assert f"Invalid value for '{command[-1]}'" in said.output


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (("campaign", "pack", "a.log", "--output", "a.zip"), "campaign.toml: cannot be read: Not a directory"),
        (("reprocess", "a.log", "--output", "out"), "a.log: has no archive.toml"),
        (("state", "list", "--url", "http://[::1"), "cannot reach the service: Invalid port"),
        (("check-config", "deep.toml"), "deep.toml: not valid TOML"),
        (("check-config", "long.toml"), "long.toml: not valid TOML"),
        (("check-config", "nul.toml"), "nul.toml: store.directory: contains a NUL character"),
    ],
)
def test_unreadable_and_unreachable_things_are_reported_in_one_line(
    command: tuple[str, ...], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.log").write_text("(1.0) can0 120#00\n")
    Path("deep.toml").write_text("a = " + "[" * 5000)
    Path("nul.toml").write_text('signals = "springscale:reference"\n[store]\ndirectory = "a\\u0000"')
    Path("long.toml").write_text("a = " + "1" * 5000)
    with pytest.raises(SpringscaleError, match=re.escape(said)):
        run(*command)


HEAVY = ("scipy", "asammdf", "pandas", "matplotlib", "numba", "polars")


FITTING = ("gateway.calibration.ratio_index", "gateway.calibration.inspection", "gateway.calibration.from_drives")


def python(code: str) -> str:
    """The output of the code in a process of its own."""
    return ended(sys.executable, "-c", code).stdout


@pytest.mark.parametrize(
    ("modules", "unneeded"),
    [
        ("gateway", ("gateway.", "numpy")),  # the Python API
        ("gateway.service.gateway", HEAVY),
        ("gateway.cli.run, gateway.service.lifecycle", ("gateway.bus.sink", "gateway.bus.feeder")),  # what sends
        ("gateway.cli, gateway.bus.logs", ("asammdf",)),  # python-can takes it, and pandas: two seconds of every start
        ("gateway.calibration.file", FITTING),  # these take the others
    ],
)
def test_nothing_is_imported_that_is_not_needed(modules: str, unneeded: tuple[str, ...]) -> None:
    found = python(f"import sys, {modules}; print([name for name in sys.modules if name.startswith({unneeded})])")
    assert found.strip() == "[]"


WEIGHED = """
import sys
from benchmarks.speed.meter import CALIBRATION
from gateway.bus.signals import Decoder
from gateway.core.batch_settings import BatchSettings
from gateway.setup import load_setup
from gateway.workbench.simulated_drives import demo_drive, frames_of

setup, frames = load_setup("springscale:reference", CALIBRATION), frames_of(demo_drive())
for name in [name for name in sys.modules if name.partition(".")[0] == "scipy"]:
    sys.modules[name] = None  # what the simulator took; from now on an import fails
flow = setup.flow(BatchSettings())
found = [*flow.feed(Decoder(setup.signal_map).decode(frames)), *flow.flush()]
print(sum(one.counted for one in found))
"""


def test_weighing_needs_no_scipy() -> None:
    """It held a fifth of a service's memory."""
    assert int(python(WEIGHED)) > 3


CODE = """
import resource
from gateway.calibration.learning.work import _take_little
if {outside}:
    resource.setrlimit(resource.RLIMIT_AS, ({outside}, {outside}))
_take_little(8000.0)
print(*resource.getrlimit(resource.RLIMIT_AS))
"""


@pytest.mark.parametrize(("outside", "most"), [(0, 8_000_000_000), (6_000_000_000, 6_000_000_000)])
def test_the_narrower_of_two_bounds_holds(outside: int, most: int) -> None:
    assert python(CODE.format(outside=outside)).split() == [str(most)] * 2
