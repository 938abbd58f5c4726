"""springscale calibration tare: re-zero a running service. It asks the service itself, which alone keeps tares."""

import functools
import json
import ssl
import urllib.error
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

import click

from gateway.cli.options import FILE, as_json
from gateway.config import load_settings
from gateway.errors import ConfigurationError, SpringscaleError
from gateway.estimate import Z95
from gateway.records import json_line

PATH: Final = "/api/v1/calibration/tare"
TIMEOUT_S: Final = 15.0
CLEAR_STDS: Final = 2.0  # an offset of more standard deviations than this speaks for a drift
QUANTITIES: Final = (("payload", "kg"), ("front_share", "pct"))
EVERYWHERE: Final = frozenset({"0.0.0.0", "::"})

Command = Callable[..., None]


@dataclass(frozen=True, slots=True)
class _Service:
    """Which service is asked, and how."""

    config_path: Path | None
    url: str | None
    token: str | None
    ca: Path | None
    certificate: Path | None
    key: Path | None


@click.group("tare")
def tare_commands() -> None:
    """Re-zero a running service while its vehicle is empty, undo that, and see what was done."""


def _service(command: Command) -> Command:
    """The options that say which service is asked; handed to ``command`` as one."""

    @functools.wraps(command)
    def asking(**options: Any) -> None:
        service = _Service(**{each.name: options.pop(each.name) for each in fields(_Service)})
        command(service, **options)

    decorated: Command = asking
    for option in (
        click.option("--key", type=FILE, default=None, help="PEM file of its key, where that is a file of its own"),
        click.option(
            "--certificate",
            type=FILE,
            default=None,
            help="PEM file of our certificate, for a service that wants one",
        ),
        click.option("--ca", type=FILE, default=None, help="PEM file of the authority that signed its certificate"),
        click.option("--token", envvar="SPRINGSCALE_TOKEN", default=None, help="token, if the service wants one"),
        click.option("--url", default=None, help="address of the service, such as http://127.0.0.1:8000"),
        click.option("--config", "config_path", type=FILE, default=None, help="springscale.toml of the service"),
    ):
        decorated = option(decorated)
    return decorated


@tare_commands.command("show")
@_service
@as_json
def show(service: _Service, as_json: bool) -> None:
    """The zero in use, what another would be made from now, and the history."""
    state = _asked(service, "GET")
    click.echo(json_line(state) if as_json else _state_text(state))


@tare_commands.command("set")
@click.option("--empty", is_flag=True, help="you know that the vehicle is empty, and was when it was last weighed")
@click.option("--note", default=None, help="kept in the history")
@_service
@as_json
def set_tare(service: _Service, empty: bool, note: str | None, as_json: bool) -> None:
    """Make the last weighing the zero of the empty vehicle, from the next batch on."""
    if not empty:
        raise click.UsageError("say --empty: a tare is for a vehicle that you know to be empty")
    claim = {"is_empty": True} | ({} if note is None else {"note": note})
    made = _asked(service, "POST", body=claim)
    click.echo(json_line(made) if as_json else _tare_text(made))


@tare_commands.command("undo")
@click.option("--factory", is_flag=True, help="all tares: back to the zero of the calibration")
@_service
@as_json
def undo(service: _Service, factory: bool, as_json: bool) -> None:
    """Take the last tare out of use; the one before it counts again."""
    state = _asked(service, "DELETE", "?to=factory" if factory else "")
    click.echo(json_line(state) if as_json else _state_text(state))


def _address(service: _Service) -> str:
    if (service.config_path is None) == (service.url is None):
        raise click.UsageError("give --config FILE of the service, or its --url")
    if service.config_path is not None:
        return _configured_address(service.config_path) + PATH
    url = service.url or ""
    if not url.startswith(("http://", "https://")):
        raise click.UsageError(f"{url!r} is no address such as http://127.0.0.1:8000")
    return url.rstrip("/") + PATH


def _configured_address(config_path: Path) -> str:
    web = load_settings(config_path).web
    if web.port == 0:
        raise ConfigurationError(f"{config_path}: [web] port = 0 names no port: give --url of the running service")
    host = "127.0.0.1" if web.host in EVERYWHERE else web.host
    scheme = "http" if web.tls_certificate is None else "https"
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{web.port}"


def _asked(service: _Service, method: str, query: str = "", body: dict[str, Any] | None = None) -> dict[str, Any]:
    """The service's answer. Raises SpringscaleError with its own words where it refuses, or where it is not there."""
    address = _address(service)
    headers = {"Accept": "application/json", "Content-Type": "application/json"}
    if service.token:
        headers["Authorization"] = f"Bearer {service.token}"
    content = None if body is None else json_line(body).encode()
    request = urllib.request.Request(address + query, content, headers, method=method)
    try:
        with _opener(service).open(request, timeout=TIMEOUT_S) as answer:
            record: dict[str, Any] = json.load(answer)
            return record
    except urllib.error.HTTPError as refusal:
        raise SpringscaleError(f"{address}: {_said(refusal)}") from None
    except (OSError, ValueError) as fault:  # not there, not trusted, or not JSON
        raise SpringscaleError(
            f"{address}: no service answers there as it should: {getattr(fault, 'reason', fault)}"
        ) from None


def _opener(service: _Service) -> urllib.request.OpenerDirector:
    """Straight to the service, past any proxy; certificates are checked, and ours is shown where there is one."""
    try:
        context = ssl.create_default_context(cafile=service.ca)
    except OSError as fault:
        raise ConfigurationError(f"{service.ca}: no certificate of an authority: {fault}") from None
    if service.certificate is None and service.key is not None:
        raise click.UsageError("--key is the key of a --certificate: give both, or neither")
    if service.certificate is not None:
        try:
            context.load_cert_chain(service.certificate, service.key)
        except OSError as fault:  # ssl.SSLError is one
            raise ConfigurationError(f"{service.certificate}: no certificate with its key: {fault}") from None
    return urllib.request.build_opener(urllib.request.ProxyHandler({}), urllib.request.HTTPSHandler(context=context))


def _said(refusal: urllib.error.HTTPError) -> str:
    """Detail and reason of a problem; the status where something else answered."""
    try:
        problem = json.load(refusal)
        return f"{problem['detail']}" + (f" ({problem['reason']})" if problem.get("reason") else "")
    except (ValueError, KeyError, TypeError):
        return f"answered {refusal.code} {refusal.reason}"


def _state_text(state: dict[str, Any]) -> str:
    active, offer = state["active"], state["offer"]
    lines = [f"in use: {'the zero of the calibration' if active is None else _tare_text(active)}"]
    if offer["is_possible"]:
        zero = offer["zero"]
        span = f"{zero['t_start'][:19]}Z to {zero['t_end'][:19]}Z"
        lines.append(f"a tare now would take off {_zero_text(zero)}, weighed {span}{_advice(zero)}")
    else:
        lines.append(f"no tare now ({offer['reason']}): {offer['detail']}")
    lines += [f"  {_tare_text(entry)}{_end_text(entry['ended'])}" for entry in state["history"]]
    return "\n".join(lines)


def _advice(zero: dict[str, Any]) -> str:
    """A zero that is not clearly away from none corrects nothing, and its uncertainty stays in every answer."""
    is_clear = any(abs(zero[f"{what}_{unit}"]) > CLEAR_STDS * zero[f"{what}_std_{unit}"] for what, unit in QUANTITIES)
    return "" if is_clear else "; that is within its own uncertainty: nothing speaks for a drift"


def _tare_text(entry: dict[str, Any]) -> str:
    note = f" ({entry['note']})" if entry["note"] else ""
    return f"{entry['id'][:19]} {_zero_text(entry)}, set {entry['at'][:19]}Z by {entry['by']}{note}"


def _zero_text(zero: dict[str, Any]) -> str:
    payload = f"{zero['payload_kg']:+.1f} ± {Z95 * zero['payload_std_kg']:.1f} kg"
    share = f"{zero['front_share_pct']:+.2f} ± {Z95 * zero['front_share_std_pct']:.2f} pp"
    return f"{payload} and {share} (95 %) from {_batches(zero['n_batches'])}"


def _batches(n: int) -> str:
    return "one batch" if n == 1 else f"{n} batches"


def _end_text(ended: dict[str, Any] | None) -> str:
    return "" if ended is None else f", {ended['why']} {ended['at'][:19]}Z by {ended['by']}"
