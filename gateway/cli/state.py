"""springscale state: what is aboard, said to a running service, and what became of it."""

from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote, urlencode
from zoneinfo import ZoneInfo

import click

from gateway.cli.options import FILE, MOMENT, ZONE, NumberRange
from gateway.cli.service import Answer, Command, Service, only_one, prints_answer
from gateway.errors import ConfigurationError
from gateway.stated.learning import STATES

PATH: Final = "/api/v1/statements"
LEARNING: Final = "/api/v1/learning"
_HELD: Final = "it is not learnt from: `springscale state confirm {id}` if it is right, `... withdraw {id}` if not"


def _kg(load: Answer) -> str:
    return f"{load['payload_kg']:.0f} ± {load['plus_minus_kg']:.0f} kg"


_LOADS: Final[tuple[tuple[str, Callable[[Answer], str]], ...]] = (
    ("payload_kg", lambda load: f"{load['payload_kg']:g} kg"),
    ("gross_kg", lambda load: f"{load['gross_kg']:g} kg gross"),
    ("front_axle_kg", lambda load: f"{load['front_axle_kg']:g} and {load['rear_axle_kg']:g} kg on the axles"),
    ("change_kg", lambda load: f"{load['change_kg']:+g} kg"),
)


def _load(one: Answer) -> str:
    load = one["load"]
    if one["source"] == "empty":
        return "empty"
    said = next(words(load) for name, words in _LOADS if load[name] is not None)
    return said if load["plus_minus_kg"] is None else f"{said}, ± {load['plus_minus_kg']:g}"


def _line(one: Answer) -> Iterator[str]:
    until = "" if one["until"] is None else f" to {one['until'][:16]}"
    ref = f" {one['ref']}" if one["ref"] else ""
    found = f"; found without it: {_kg(one['found'])}" if one["found"] else ""
    source = one["source"].replace("_", " ")
    said = "" if one["source"] == "empty" else f"{_load(one)}, "
    yield f"{one['id']}{ref}: {said}{source}, from {one['from'][:16]}{until}: {one['state']}{found}"
    for name in ("question", "reason"):
        if one[name]:
            yield f"    {one[name]}"
    if one["state"] == "held":
        yield f"    {_HELD.format(id=one['id'])}"


def _one_text(one: Answer) -> str:
    return "\n".join(_line(one))


def _list_text(page: Answer) -> str:
    lines = [line for one in page["items"] for line in _line(one)]
    return "\n".join(lines) or "nothing is stated yet: `springscale state note 310` says what is aboard"


def _import_text(told: Answer) -> str:
    lines = [told["text"], *(f"  {note}" for note in told["notes"])]
    lines += [f"  row {one['row']}: {one['text']}" for one in told["problems"]]
    return "\n".join([*lines, *(["nothing is stored: this was a dry run"] if told["is_dry_run"] else [])])


def _statement(command: Command) -> Command:
    """The options that every statement has."""
    for option in (
        click.option("--note", default=None, help="kept with it: place, scales used"),
        click.option("--check", is_flag=True, help="compare it only: nothing is learnt from it"),
        click.option(
            "--ref", default=None, help="your own name for it, such as a note's number; the same one replaces"
        ),
        click.option("--until", type=MOMENT, default=None, help="when this ended [default: when the load changes]"),
        click.option("--from", "since", type=MOMENT, default=None, help="when this began [default: now]"),
    ):
        command = option(command)
    return command


def _stated(
    service: Service,
    source: str,
    load: dict[str, Any] | None,
    *,
    since: datetime | None,
    until: datetime | None,
    ref: str | None,
    check: bool,
    note: str | None,
) -> Answer:
    body: dict[str, Any] = {
        "from": (since or datetime.now(UTC)).isoformat(timespec="seconds"),
        "until": None if until is None else until.isoformat(timespec="seconds"),
        "source": source,
        "ref": ref,
        "learn": not check,
        "note": note or "",
    }
    told = {name: kg for name, kg in (load or {}).items() if kg is not None}
    return service.ask(PATH, "POST", body | ({"load": told} if told else {}))


_plus_minus = click.option("--plus-minus", type=NumberRange(), default=None, help="half the 95 % interval, in kg")


@click.group("state")
def state() -> None:
    """Say to a running service what its vehicle carries: it learns from that, and tests it first."""


@state.command("empty")
@_statement
@prints_answer(_one_text)
def state_empty(service: Service, **options: Any) -> Answer:
    """The vehicle is empty."""
    return _stated(service, "empty", None, **options)


def _left_text(learning: Answer) -> str:
    left = [one["text"] for one in _looking_empty(learning)]
    return "\n".join(left) or "noted: these drives are not asked about again"


def _looking_empty(learning: Answer) -> list[Answer]:
    return [one for one in learning["questions"] if one["kind"] == "looks_empty"]


@state.command("not-empty")
@click.argument("begins", metavar="[FROM]...", nargs=-1, type=MOMENT)
@prints_answer(_left_text)
def state_not_empty(service: Service, begins: tuple[datetime, ...]) -> Answer:
    """Drives that look empty were not: those that begin at FROM, as they are asked about, or all of them."""
    drives = [one["from"] for asked in _looking_empty(service.ask(LEARNING)) for one in asked["propose"]]
    wanted = {f"{one:%Y-%m-%dT%H:%M}" for one in begins}
    chosen = [one for one in drives if not wanted or one[:16] in wanted]
    if not chosen:
        raise ConfigurationError("no such drive is asked about: the page /teach has the questions")
    return service.ask(LEARNING, "PUT", {"not_empty": chosen})


@state.command("note")
@click.argument("kg", type=NumberRange())
@_plus_minus
@_statement
@prints_answer(_one_text)
def state_note(service: Service, kg: float, plus_minus: float | None, **options: Any) -> Answer:
    """KG are aboard by the delivery note."""
    return _stated(service, "delivery_note", {"payload_kg": kg, "plus_minus_kg": plus_minus}, **options)


@state.command("scale")
@click.option("--gross", type=NumberRange(), required=True, help="what the scale shows of the whole vehicle, in kg")
@_plus_minus
@_statement
@prints_answer(_one_text)
def state_scale(service: Service, gross: float, plus_minus: float | None, **options: Any) -> Answer:
    """The vehicle was weighed as a whole."""
    return _stated(service, "scale", {"gross_kg": gross, "plus_minus_kg": plus_minus}, **options)


@state.command("axles")
@click.argument("front", type=NumberRange())
@click.argument("rear", type=NumberRange())
@_plus_minus
@_statement
@prints_answer(_one_text)
def state_axles(service: Service, front: float, rear: float, plus_minus: float | None, **options: Any) -> Answer:
    """FRONT and REAR kg were weighed, axle by axle."""
    load = {"front_axle_kg": front, "rear_axle_kg": rear, "plus_minus_kg": plus_minus}
    return _stated(service, "axle_scales", load, **options)


@state.command("list")
@click.option("--state", "wanted", type=click.Choice(STATES), default=None, help="only those in this state")
@click.option("--since", type=MOMENT, default=None, help="only those that hold then or begin later")
@prints_answer(_list_text)
def state_list(service: Service, wanted: str | None, since: datetime | None) -> Answer:
    """Every statement, the newest first, with what the vehicle said without it."""
    query = {"state": wanted, "since": None if since is None else f"{since:%Y-%m-%dT%H:%M:%SZ}"}
    asked = urlencode({name: value for name, value in query.items() if value is not None})
    return service.ask(PATH + (f"?{asked}" if asked else ""))


@state.command("withdraw")
@click.argument("statement_id", metavar="ID")
@prints_answer(_one_text)
def state_withdraw(service: Service, statement_id: str) -> Answer:
    """Withdraw the statement ID, as `list` prints it, or its first letters: it is as if it had never been stated."""
    return service.ask(f"{PATH}/{quote(_standing(service, statement_id))}", "DELETE")


@state.command("confirm")
@click.argument("statement_id", metavar="ID")
@prints_answer(_one_text)
def state_confirm(service: Service, statement_id: str) -> Answer:
    """The statement ID is right although its drive contradicts it."""
    return service.ask(f"{PATH}/{quote(_standing(service, statement_id))}/confirm", "POST")


@state.command("import")
@click.argument("file", type=FILE)
@click.option("--dry-run", is_flag=True, help="say which rows match a drive, and store nothing")
@click.option("--timezone", "zone", type=ZONE, default=None, help="of times without one [default: UTC]")
@prints_answer(_import_text)
def state_import(service: Service, file: Path, dry_run: bool, zone: ZoneInfo | None) -> Answer:
    """Take a table of delivery notes (CSV) or a list of statements (JSON)."""
    try:
        content = file.read_bytes()
    except OSError as fault:
        raise ConfigurationError(f"{file}: cannot be read: {fault.strerror or fault}") from None
    query = urlencode({"dry_run": str(dry_run).lower()} | ({} if zone is None else {"timezone": zone.key}))
    kind = "application/json" if content.lstrip()[:1] in (b"[", b"{") else "text/csv"
    return service.send(f"{PATH}?{query}", content, kind)


def _standing(service: Service, begin: str) -> str:
    """The statement that stands whose id, or whose ref, begins with this text. Raises SpringscaleError."""
    items = [one for one in service.ask(PATH)["items"] if one["state"] != "withdrawn"]
    by_ref = [one["id"] for one in items if one["ref"] == begin]
    return (
        by_ref[0] if by_ref else only_one([one["id"] for one in items], begin, "statements", "springscale state list")
    )
