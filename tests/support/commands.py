"""The command line as a person calls it, in this process; and other commands, in processes of their own."""

import subprocess
from typing import Any

from click.testing import CliRunner, Result

from gateway.cli import springscale
from support.patience import PATIENCE_S


def called(*arguments: object) -> Result:
    """The result of a command, whether it ends well or not."""
    return CliRunner().invoke(springscale, [*map(str, arguments)])


def run(*arguments: object) -> Result:
    """The result of a command that must end well."""
    done = CliRunner().invoke(springscale, [*map(str, arguments)], catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return done


def printed(*arguments: object) -> str:
    """The standard output of a command that must end well."""
    return run(*arguments).stdout


def ended(*command: object, check: bool = True, **how: Any) -> "subprocess.CompletedProcess[str]":
    """What a command in a process of its own has said; unless ``check`` is False it must end well."""
    words = [*map(str, command)]
    return subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE_S, check=check, **how)
