"""Requests of commands to a running service: address, token, certificates, and its error messages."""

import functools
import ssl
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final

import click
import httpx

from gateway.cli.options import FILE, Told, config, prints
from gateway.config import load_settings
from gateway.errors import ConfigurationError, SpringscaleError
from gateway.records import json_line

TIMEOUT_S: Final = 15.0  # chosen: for an answer, behind a slow link
EVERYWHERE: Final = frozenset({"0.0.0.0", "::"})

Command = Callable[..., Any]
Answer = dict[str, Any]  # of the service, as JSON gives it


@dataclass(frozen=True, slots=True)
class Service:
    """Which service to use, and how."""

    config_path: Path | None
    url: str | None
    token: str | None
    ca: Path | None

    def address(self, path: str) -> str:
        """Where ``path`` is. Raises a usage error if the options name no service, or two."""
        if (self.config_path is None) == (self.url is None):
            raise click.UsageError("give --config FILE of the service, or its --url")
        if self.config_path is not None:
            return _configured_address(self.config_path) + path
        url = self.url or ""
        if not url.startswith(("http://", "https://")):
            raise click.UsageError(f"{url!r} is not an address such as http://127.0.0.1:8000")
        return url.rstrip("/") + path

    def ask(self, path: str, method: str = "GET", body: Mapping[str, Any] | None = None) -> Answer:
        """The service's answer as JSON. Raises SpringscaleError with its message if it refuses or cannot be reached."""
        content = None if body is None else json_line(body).encode()
        return _json_of(self._answer(path, method, content))

    def send(self, path: str, content: bytes, kind: str) -> Answer:
        """Post a file of this media type -> the answer as JSON. Raises as ``ask`` does."""
        return _json_of(self._answer(path, "POST", content, kind))

    def _answer(
        self, path: str, method: str = "GET", content: bytes | None = None, kind: str = "application/json"
    ) -> httpx.Response:
        address, context = self.address(path), self._context()
        headers = {"accept": "application/json, */*;q=0.5", "content-type": kind}
        if self.token:
            headers["authorization"] = f"Bearer {self.token}"
        try:
            with httpx.Client(verify=context, timeout=TIMEOUT_S, trust_env=False) as client:
                answer = client.request(method, address, content=content, headers=headers)
        except (httpx.HTTPError, httpx.InvalidURL, ValueError) as fault:  # not reachable, not trusted, or not HTTP
            raise SpringscaleError(f"{address}: cannot reach the service: {_why(fault)}") from None
        if answer.is_error:
            raise SpringscaleError(f"{address}: {_said(answer)}")
        return answer

    def _context(self) -> ssl.SSLContext:
        """Trusts the system's authorities, or only that of ``ca``."""
        try:
            return ssl.create_default_context(cafile=self.ca)
        except OSError as fault:  # ssl.SSLError is one
            raise ConfigurationError(f"{self.ca}: no certificate of an authority: {fault}") from None


def _json_of(answer: httpx.Response) -> Answer:
    """The object of an answer. Raises SpringscaleError if it is none."""
    try:
        record: Answer = answer.json()
    except ValueError:
        kind = answer.headers.get("content-type", "something")
        raise SpringscaleError(
            f"{answer.url}: answered with {kind} in place of JSON: is a proxy or another program there?"
        ) from None
    return record


def only_one(ids: Iterable[str], begin: str, what: str, command: str) -> str:
    """The id that begins with this text, sha256: aside. Raises SpringscaleError if there are none or several."""
    found = [one for one in ids if one.startswith(begin) or one.removeprefix("sha256:").startswith(begin)]
    if len(found) != 1:
        raise SpringscaleError(f"{begin}: {len(found) or 'no'} {what} begin like this: `{command}` lists them")
    return found[0]


_OF_SERVICE: Final = (
    config,
    click.option("--url", default=None, help="address of the service, such as http://127.0.0.1:8000"),
    click.option("--token", envvar="SPRINGSCALE_TOKEN", default=None, help="token, if the service requires one"),
    click.option("--ca", type=FILE, default=None, help="PEM file of the authority that signed its certificate"),
)


def prints_answer(text: Callable[[Answer], str]) -> Callable[[Command], Command]:
    """The options that name the service, which becomes the command's first argument, and --json; what the command
    returns is printed by ``text`` or as JSON.
    """

    def decorate(command: Command) -> Command:
        @functools.wraps(command)
        def told(**options: Any) -> Told:
            service = Service(**{each.name: options.pop(each.name) for each in fields(Service)})
            answer: Answer = command(service, **options)
            return answer, text(answer)

        decorated: Command = prints(told)
        for option in reversed(_OF_SERVICE):
            decorated = option(decorated)
        return decorated

    return decorate


def _configured_address(config_path: Path) -> str:
    web = load_settings(config_path).web
    if web.port == 0:
        raise ConfigurationError(f"{config_path}: [web] port = 0 names no port: give --url of the running service")
    host = "127.0.0.1" if web.host in EVERYWHERE else web.host
    scheme = "http" if web.tls_certificate is None else "https"
    return f"{scheme}://{f'[{host}]' if ':' in host else host}:{web.port}"


def _said(answer: httpx.Response) -> str:
    """Detail and reason of a problem; the status if something else answered."""
    try:
        problem = answer.json()
        return f"{problem['detail']}" + (f" ({problem['reason']})" if problem.get("reason") else "")
    except (ValueError, KeyError, TypeError):
        return f"answered {answer.status_code} {answer.reason_phrase}"


def _why(fault: Exception) -> str:
    if isinstance(fault, httpx.ConnectError) and "refused" in str(fault):
        return (
            "nothing is listening there: is the service running? "
            "With a new calibration it restarts, which takes a few seconds"
        )
    return str(fault)
