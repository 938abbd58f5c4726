"""springscale calibration tare and ticket: known weights of a running service, which alone keeps them."""

from typing import Any, Final

import click

from gateway.cli.commission import end_text
from gateway.cli.options import LoadArgument
from gateway.cli.service import Answer, Service, only_one, prints_answer
from gateway.estimate import Z95
from gateway.words import one_or_more

PATH: Final = "/api/v1/known-weights"
TARE: Final = "/api/v1/calibration/tare"
_HELD: Final = (
    "; not used, for it contradicts the estimate: `springscale calibration ticket confirm {id}` uses it,"
    " `... withdraw {id}` takes it back"
)
KINDS: Final = ("ticket", "axle_pads", "delivery_note")


def _state_text(state: Answer) -> str:
    lines = [_count_text(state)]
    offer = state["offer"]
    if offer["is_possible"]:
        load = offer["load"]
        span = f"{load['t_start'][:19]}Z to {load['t_end'][:19]}Z"
        batches = one_or_more(load["n_batches"], "batch", "batches")
        lines.append(f"a tare now would be of {_payload(load)}, weighed {span} in {batches}")
    else:
        lines.append(f"no tare now ({offer['reason']}): {offer['detail']}")
    if state["fault"]:
        lines.append(state["fault"])
    return "\n".join([*lines, *(f"  {_entry_text(one)}" for one in state["history"])])


def _count_text(state: Answer) -> str:
    if not state["n_teaching"]:
        return "no known weight is in use: weighed by the calibration alone"
    scatter = "" if state["error_std_kg"] is None else f" (scatter {state['error_std_kg']:.1f} kg)"
    known = one_or_more(state["n_teaching"], "known weight", "known weights")
    return f"{known} in use; without them the estimates' error is {state['mean_error_kg']:+.1f} kg{scatter}"


def _payload(load: Answer, name: str = "payload") -> str:
    return f"{load[f'{name}_kg']:.1f} ± {Z95 * load[f'{name}_std_kg']:.1f} kg"


def _entry_text(one: Answer) -> str:
    note = f" ({one['note']})" if one["note"] else ""
    kind = one["kind"].replace("_", " ")
    held = _HELD.format(id=one["id"][:19]) if one["state"] == "held" else ""
    text = f"{one['id'][:19]} {kind}: {_payload(one)} known, {_payload(one, 'estimated_payload')} estimated without it"
    return f"{text}, driven {one['t_start'][:16]}Z, by {one['by']}{note}{held}{end_text(one['ended'])}"


@click.group("tare")
def tare_commands() -> None:
    """State to a running service that its vehicle is empty, take that back, and see what was done."""


@tare_commands.command("show")
@prints_answer(_state_text)
def show_tares(service: Service) -> Answer:
    """The tares in use, the load to which "it is empty now" would apply, and the history."""
    return service.ask(TARE)


@tare_commands.command("set")
@click.option("--empty", is_flag=True, help="you know that the vehicle is empty, and was when it was last weighed")
@click.option("--note", default=None, help="kept in the history")
@prints_answer(_entry_text)
def set_tare(service: Service, empty: bool, note: str | None) -> Answer:
    """The vehicle is empty: every estimate from the next batch on takes that into account."""
    if not empty:
        raise click.UsageError("say --empty: a tare is for a vehicle that you know to be empty")
    return service.ask(TARE, "POST", {"is_empty": True} | _noted(note))


@tare_commands.command("undo")
@click.option("--factory", is_flag=True, help="all tares")
@prints_answer(_state_text)
def undo(service: Service, factory: bool) -> Answer:
    """Take the last tare back."""
    return service.ask(TARE + ("?to=factory" if factory else ""), "DELETE")


@click.group("ticket")
def ticket_commands() -> None:
    """State known weights of loads to a running service; confirm them; take them back."""


@ticket_commands.command("show")
@prints_answer(_state_text)
def show_tickets(service: Service) -> Answer:
    """Every known weight, "empty" among them, the estimate without it, and the errors of these estimates."""
    return service.ask(PATH)


@ticket_commands.command("add")
@click.argument("weight", type=LoadArgument())
@click.option("--kind", type=click.Choice(KINDS), default="ticket", show_default=True, help="where it comes from")
@click.option("--note", default=None, help="kept with it: number of the ticket, place")
@prints_answer(_entry_text)
def add(service: Service, weight: dict[str, Any], kind: str, note: str | None) -> Answer:
    """State WEIGHT, such as front_axle_kg=850,rear_axle_kg=1040,at=2026-11-21T04:10:00Z,drive=before."""
    return service.ask(PATH, "POST", {"kind": kind, "weight": weight} | _noted(note))


@ticket_commands.command("confirm")
@click.argument("ticket_id")
@prints_answer(_state_text)
def confirm(service: Service, ticket_id: str) -> Answer:
    """TICKET_ID is right although its estimate contradicts it: take it into use."""
    return service.ask(f"{PATH}/{_standing(service, ticket_id)}/confirm", "POST", {})


@ticket_commands.command("withdraw")
@click.argument("ticket_id")
@prints_answer(_state_text)
def withdraw(service: Service, ticket_id: str) -> Answer:
    """Take TICKET_ID back, as `show` prints it, or its first letters: the numbers are as if it had never been
    stated.
    """
    return service.ask(f"{PATH}/{_standing(service, ticket_id)}", "DELETE")


def _standing(service: Service, begin: str) -> str:
    """The entry in use whose id begins with this text."""
    ids = [one["id"] for one in service.ask(PATH)["history"] if one["ended"] is None]
    return only_one(ids, begin, "known weights", "springscale calibration ticket show")


def _noted(note: str | None) -> dict[str, str]:
    return {} if note is None else {"note": note}
