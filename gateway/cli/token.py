"""springscale token: who may use the gateway from elsewhere."""

import json
from pathlib import Path

import click

from gateway.cli.options import NumberRange
from gateway.config import load_settings
from gateway.files.owned import become_owner_of
from gateway.units import S_PER_DAY
from gateway.web.access.tokens import Scope, TokenFile

_config = click.option(
    "--config", "config_path", type=click.Path(path_type=Path), required=True, help="springscale.toml of the service"
)


def token_file(config_path: Path) -> TokenFile:
    """The tokens of the service that this file configures: tokens.json beside its database.

    Root gives up its rights first: files in the service's directory are the service's, links included.
    """
    directory = load_settings(config_path).store.directory
    become_owner_of(directory)
    return TokenFile(directory / "tokens.json")


@click.group("token")
def token() -> None:
    """Make, list and revoke access tokens for other machines."""


@token.command("create")
@click.argument("name")
@click.option(
    "--scope",
    type=click.Choice([str(scope) for scope in Scope]),
    default="read",
    show_default=True,
    help="read: may read; operate: may also change something",
)
@click.option("--days", type=NumberRange(min=0.0, min_open=True), help="period of validity; else until revoked")
@_config
def create(name: str, scope: str, days: float | None, config_path: Path) -> None:
    """Make a token called NAME and print it, this once."""
    lifetime_s = None if days is None else days * S_PER_DAY
    click.echo(token_file(config_path).create(name, Scope(scope), lifetime_s))


@token.command("list")
@click.option("--json", "as_json", is_flag=True, help="one JSON object a line")
@_config
def list_tokens(as_json: bool, config_path: Path) -> None:
    """List the tokens; their secrets cannot be shown."""
    for held in token_file(config_path).tokens():
        if as_json:
            click.echo(json.dumps({"id": held.id, "name": held.name, "scope": held.scope, "ends": held.expiry()}))
        else:
            click.echo(f"{held.id}  {held.scope:8}{held.expiry():>18}  {held.name}")


@token.command("revoke")
@click.argument("name")
@_config
def revoke(name: str, config_path: Path) -> None:
    """Refuse from now on the token of this NAME (or id); a running service follows at once."""
    token_file(config_path).revoke(name)
