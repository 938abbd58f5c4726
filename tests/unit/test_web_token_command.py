"""springscale token: made once, listed without its secret, revoked."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from gateway.cli.token import token as token_commands
from gateway.errors import ConfigurationError
from gateway.web.access.tokens import TokenFile


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "springscale.toml"
    path.write_text('signals = "signals.toml"\n[store]\ndirectory = "state"\n')
    return path


def run(config: Path, *arguments: str) -> Result:
    return CliRunner().invoke(token_commands, [*arguments, "--config", str(config)])


def test_a_token_is_made_listed_and_revoked(config: Path) -> None:
    made = run(config, "create", "fleet", "--scope", "operate", "--days", "30")
    text = made.output.strip()
    token = TokenFile(config.parent / "state" / "tokens.json").verify(text)
    assert token is not None
    assert token.expires_s == token.created_s + 30 * 86_400

    listed = json.loads(run(config, "list", "--json").output)
    assert (listed["name"], listed["scope"], listed["id"]) == ("fleet", "operate", token.id)
    assert text.split("_", 2)[2] not in run(config, "list").output

    assert run(config, "revoke", "fleet").exit_code == 0
    assert run(config, "list").output == ""


def test_mistakes_are_said(config: Path) -> None:
    assert run(config, "create", "fleet", "--scope", "everything").exit_code == 2
    assert run(config, "create", "fleet", "--days", "0").exit_code == 2
    assert run(config, "create", "fleet", "--days", "nan").exit_code == 2
    assert run(config, "create", "fleet", "--days", "inf").exit_code == 2
    assert isinstance(run(config, "revoke", "fleet").exception, ConfigurationError)
