"""Tokens: shown once, kept as hashes, gone when revoked, expired or unreadable; the command that makes them."""

import json
import stat
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from support.log import names

from gateway.cli.token import token as token_commands
from gateway.errors import ConfigurationError
from gateway.log import Event
from gateway.web.access.tokens import Scope, TokenFile


class Clock:
    now_s = 1_000_000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "new folder" / "tokens.json"


def test_a_token_is_recognised_and_its_secret_is_not_kept(path: Path) -> None:
    text = TokenFile(path).create("fleet", Scope.READ)
    found = TokenFile(path).verify(text)
    assert (found.name, found.scope) == ("fleet", Scope.READ)
    kept = path.read_text()
    assert text.split("_", 2)[2] not in kept
    assert found.sha256 not in repr(found)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert [entry.name for entry in path.parent.iterdir()] == ["tokens.json"]


def test_a_token_ends_when_its_time_is_over(path: Path) -> None:
    clock = Clock()
    tokens = TokenFile(path, clock)
    text = tokens.create("short", Scope.READ, lifetime_s=60.0)
    clock.now_s += 59.0
    assert tokens.verify(text) is not None
    clock.now_s += 1.0
    assert tokens.verify(text) is None
    assert tokens.tokens()[0].expiry() == "1970-01-12T13:47Z"


def test_a_token_changed_in_any_place_is_no_token(path: Path) -> None:
    tokens = TokenFile(path)
    text = tokens.create("one", Scope.READ)
    for place, letter in enumerate(text):
        other = "A" if letter != "A" else "B"
        assert tokens.verify(text[:place] + other + text[place + 1 :]) is None
    assert tokens.verify(text + "A") is None
    assert tokens.verify(text[:-1]) is None
    assert tokens.verify(text) is not None


def test_names_are_unique_and_unknown_ones_are_reported(path: Path) -> None:
    tokens = TokenFile(path)
    tokens.create("fleet", Scope.READ)
    with pytest.raises(ConfigurationError, match="already"):
        tokens.create("fleet", Scope.OPERATE)
    with pytest.raises(ConfigurationError, match="no token 'flet'"):
        tokens.revoke("flet")


NOT_UTF8 = b'{"format": "springscale-tokens", "version": 1, "tokens": [{"name": "caf\xe9"}]}'
BROKEN = [b"", b"{", b"[]", b"[" * 5000, b'{"note": "\\ud83d"}', b'{"format": "other", "version": 1}', NOT_UTF8]


@pytest.mark.parametrize("content", BROKEN)
def test_a_broken_file_closes_the_door_and_is_not_overwritten(
    content: bytes, path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    assert not TokenFile(path).are_required()
    running = TokenFile(path)
    lost = running.create("fleet", Scope.READ)
    assert running.verify(lost) is not None
    path.write_bytes(content)
    assert running.verify(lost) is None
    caplog.clear()
    service = TokenFile(path)
    assert service.are_required()
    assert names(caplog) == [Event.TOKENS_UNREADABLE]
    assert service.verify(lost) is None
    assert "move it away" in (service.fault or "")
    with pytest.raises(ConfigurationError, match="move it away"):
        TokenFile(path).create("fleet", Scope.READ)
    assert path.read_bytes() == content

    path.unlink()
    assert service.are_required()  # until there are new ones
    new = TokenFile(path).create("fleet", Scope.READ)
    assert service.verify(new) is not None
    assert service.fault is None


@pytest.mark.parametrize(
    "name", ["", " fleet", "fleet ", "fl\neet", "caf\udce9", "\ud83d", "a\0b", "x" * 65, "\x1b[2J", "a\u202eb"]
)
def test_a_name_that_cannot_be_shown_is_refused_and_destroys_nothing(path: Path, name: str) -> None:
    tokens = TokenFile(path)
    text = tokens.create("first", Scope.READ)
    kept = path.read_bytes()
    with pytest.raises(ConfigurationError, match="a token's name has"):
        tokens.create(name, Scope.READ)
    assert path.read_bytes() == kept
    assert tokens.verify(text) is not None


def test_creating_and_revoking_at_once_loses_nothing(path: Path) -> None:
    doomed = [TokenFile(path).create(f"old {n}", Scope.READ) for n in range(6)]
    with ThreadPoolExecutor(12) as pool:
        made = [pool.submit(TokenFile(path).create, f"new {n}", Scope.READ) for n in range(12)]
        gone = [pool.submit(TokenFile(path).revoke, f"old {n}") for n in range(6)]
        texts = [one.result() for one in made]
        assert [one.result() for one in gone] == [None] * 6
    service = TokenFile(path)
    assert all(service.verify(text) for text in texts)
    assert not any(service.verify(text) for text in doomed)
    assert {token.name for token in service.tokens()} == {f"new {n}" for n in range(12)}


def test_a_token_that_ends_is_not_judged_by_a_clock_that_was_never_set(path: Path) -> None:
    clock = Clock()
    clock.now_s = 1_790_000_000.0
    tokens = TokenFile(path, clock)
    ends, endless = tokens.create("ends", Scope.READ, lifetime_s=60.0), tokens.create("endless", Scope.READ)
    clock.now_s += 3600.0
    assert tokens.verify(ends) is None
    clock.now_s = 5.0  # 1970: no clock battery, no date yet
    assert tokens.verify(ends) is None
    assert tokens.verify(endless) is not None


def test_an_edited_scope_must_be_a_scope(path: Path) -> None:
    TokenFile(path).create("fleet", Scope.READ)
    content = json.loads(path.read_text())
    content["tokens"][0]["scope"] = "everything"
    path.write_text(json.dumps(content))
    with pytest.raises(ConfigurationError, match="scope"):
        TokenFile(path).tokens()


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
    assert token.expires_s == token.created_s + 30 * 86_400

    listed = json.loads(run(config, "list", "--json").output)
    assert (listed["name"], listed["scope"], listed["id"]) == ("fleet", "operate", token.id)
    assert text.split("_", 2)[2] not in run(config, "list").output

    assert run(config, "revoke", "fleet").exit_code == 0
    assert run(config, "list").output == ""


def test_usage_errors_are_reported(config: Path) -> None:
    assert run(config, "create", "fleet", "--scope", "everything").exit_code == 2
    assert run(config, "create", "fleet", "--days", "0").exit_code == 2
    assert run(config, "create", "fleet", "--days", "nan").exit_code == 2
    assert run(config, "create", "fleet", "--days", "inf").exit_code == 2
    assert isinstance(run(config, "revoke", "fleet").exception, ConfigurationError)
