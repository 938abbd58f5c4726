"""`springscale demo` whose drive fails: the service ends, and so does the command, with the fault."""

import pytest
from click.testing import CliRunner

from gateway.cli import springscale
from gateway.errors import BusError


def test_a_drive_that_fails_ends_the_command_with_what_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    def drive(*_: object) -> None:
        raise BusError("springscale-demo: the bus has gone")

    monkeypatch.setattr("gateway.cli.demo.demo_drive", drive)
    said = CliRunner().invoke(springscale, ["demo", "--once", "--json"])
    assert isinstance(said.exception, BusError)  # as with every command, main makes one line of it
