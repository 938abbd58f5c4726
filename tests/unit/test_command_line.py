"""What the command line says beside any one command: its version, a name mistyped, an interruption."""

import click
import pytest
from click.testing import CliRunner

import gateway.cli
from gateway.cli import INTERRUPTED, springscale


@pytest.mark.parametrize(("typed", "meant"), [("estmate", "estimate"), ("check_config", "check-config")])
def test_a_mistyped_command_is_told_which_was_meant(typed: str, meant: str) -> None:
    said = CliRunner().invoke(springscale, [typed])
    assert said.exit_code == 2
    assert f"No such command {typed!r}: did you mean {meant}?" in said.output


def test_a_name_that_resembles_none_is_only_refused() -> None:
    said = CliRunner().invoke(springscale, ["frobnicate"])
    assert said.exit_code == 2
    assert "did you mean" not in said.output


def test_ctrl_c_ends_quietly_with_the_code_of_an_interrupted_process(monkeypatch: pytest.MonkeyPatch) -> None:
    @click.command()
    def stopped() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(gateway.cli._Lazy, "get_command", lambda self, ctx, name: stopped)
    said = CliRunner().invoke(springscale, ["run"])
    assert said.exit_code == INTERRUPTED
    assert said.output == ""


def test_its_version_is_told_by_either_name() -> None:
    short, long = (CliRunner().invoke(springscale, [name]).output for name in ("-V", "--version"))
    assert short == long
    assert short.startswith("springscale, version ")
