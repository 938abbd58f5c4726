"""springscale calibration ticket: known weights that a running service's own calibration learns from."""

from typing import Any, Final

import click

from gateway.cli.asked.service import Service, asks_service
from gateway.cli.asked.stated import KnownLoad
from gateway.cli.options import as_json
from gateway.errors import SpringscaleError
from gateway.estimate import Z95
from gateway.records import json_line

PATH: Final = "/api/v1/calibration/tickets"


@click.group("ticket")
def ticket_commands() -> None:
    """Teach a vehicle that was commissioned on its own machine with known weights; take them back; see what helps."""


@ticket_commands.command("show")
@asks_service
@as_json
def show(service: Service, as_json: bool) -> None:
    """How well it weighs with the tickets it has, which load would help most, and the history."""
    state = service.ask(PATH)
    click.echo(json_line(state) if as_json else _state_text(state))


@ticket_commands.command("add")
@click.argument("weight", type=KnownLoad())
@click.option("--note", default=None, help="kept with it: number of the ticket, place")
@asks_service
@as_json
def add(service: Service, weight: dict[str, Any], note: str | None, as_json: bool) -> None:
    """Hand in WEIGHT, such as front_axle_kg=850,rear_axle_kg=1040,at=2026-11-21T04:10:00Z,drive=before."""
    made = service.ask(PATH, "POST", {"weight": weight} | ({} if note is None else {"note": note}))
    click.echo(json_line(made) if as_json else _ticket_text(made))


@ticket_commands.command("withdraw")
@click.argument("ticket_id")
@asks_service
@as_json
def withdraw(service: Service, ticket_id: str, as_json: bool) -> None:
    """Take TICKET_ID back, as `show` has it, or the first letters of it: the calibration is made anew without it."""
    standing = [one["id"] for one in service.ask(PATH)["history"] if one["withdrawn"] is None]
    found = [one for one in standing if one.startswith(ticket_id) or one.removeprefix("sha256:").startswith(ticket_id)]
    if len(found) != 1:
        raise SpringscaleError(f"{ticket_id}: {len(found)} tickets begin so: `springscale calibration ticket show`")
    state = service.ask(f"{PATH}/{found[0]}", "DELETE")
    click.echo(json_line(state) if as_json else _state_text(state))


def _state_text(state: dict[str, Any]) -> str:
    lines = [f"no tickets: {state['why_not']}"] if state["why_not"] else [_count_text(state["n_teaching"])]
    if state["is_busy"]:
        lines.append("the calibration is being made anew")
    if state["planned"] is not None:
        lines.append(_planned_text(state["planned"]))
    if state["fault"]:
        lines.append(f"the last fit made no calibration: {state['fault']}")
    return "\n".join([*lines, *(f"  {_ticket_text(one)}" for one in state["history"])])


def _count_text(n: int) -> str:
    return "one ticket teaches" if n == 1 else f"{n} tickets teach"


def _planned_text(planned: dict[str, Any]) -> str:
    now, then = (Z95 * planned[name] for name in ("payload_std_kg", "then_payload_std_kg"))
    if planned["is_enough"]:
        return f"payloads are told to ± {now:.0f} kg (95 %); no other load would narrow that by much"
    place = "" if planned["load_position_m"] is None else f", {planned['load_position_m']:.1f} m behind the front axle"
    load = f"{planned['load_kg']:.0f} kg{place}"
    return f"provisional: payloads are told to ± {now:.0f} kg (95 %); a ticket of {load} would make it ± {then:.0f} kg"


def _ticket_text(one: dict[str, Any]) -> str:
    note = f" ({one['note']})" if one["note"] else ""
    share = (
        "place unknown, teaches nothing"
        if one["front_share_pct"] is None
        else f"{one['front_share_pct']:.1f} % in front"
    )
    end = "" if one["withdrawn"] is None else f", withdrawn {one['withdrawn']['at'][:19]}Z by {one['withdrawn']['by']}"
    span = f"driven {one['t_start'][:16]}Z to {one['t_end'][:16]}Z"
    return f"{one['id'][:19]} {one['payload_kg']:.0f} kg, {share}, {span}, by {one['by']}{note}{end}"
