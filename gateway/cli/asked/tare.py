"""springscale calibration tare: re-zero a running service. It asks the service itself, which alone keeps tares."""

from typing import Any, Final

import click

from gateway.cli.asked.service import Service, asks_service
from gateway.cli.options import as_json
from gateway.cli.text.commission import end_text
from gateway.estimate import Z95
from gateway.records import json_line
from gateway.words import one_or_more

PATH: Final = "/api/v1/calibration/tare"
CLEAR_STDS: Final = 2.0  # an offset of more standard deviations than this speaks for a drift
QUANTITIES: Final = (("payload", "kg"), ("front_share", "pct"))


@click.group("tare")
def tare_commands() -> None:
    """Re-zero a running service while its vehicle is empty, undo that, and see what was done."""


@tare_commands.command("show")
@asks_service
@as_json
def show(service: Service, as_json: bool) -> None:
    """The zero in use, what another would be made from now, and the history."""
    state = service.ask(PATH)
    click.echo(json_line(state) if as_json else _state_text(state))


@tare_commands.command("set")
@click.option("--empty", is_flag=True, help="you know that the vehicle is empty, and was when it was last weighed")
@click.option("--note", default=None, help="kept in the history")
@asks_service
@as_json
def set_tare(service: Service, empty: bool, note: str | None, as_json: bool) -> None:
    """Make the last weighing the zero of the empty vehicle, from the next batch on."""
    if not empty:
        raise click.UsageError("say --empty: a tare is for a vehicle that you know to be empty")
    claim = {"is_empty": True} | ({} if note is None else {"note": note})
    made = service.ask(PATH, "POST", claim)
    click.echo(json_line(made) if as_json else _tare_text(made))


@tare_commands.command("undo")
@click.option("--factory", is_flag=True, help="all tares: back to the zero of the calibration")
@asks_service
@as_json
def undo(service: Service, factory: bool, as_json: bool) -> None:
    """Take the last tare out of use; the one before it counts again."""
    state = service.ask(PATH + ("?to=factory" if factory else ""), "DELETE")
    click.echo(json_line(state) if as_json else _state_text(state))


def _state_text(state: dict[str, Any]) -> str:
    active, offer = state["active"], state["offer"]
    lines = [f"in use: {'the zero of the calibration' if active is None else _tare_text(active)}"]
    if offer["is_possible"]:
        zero = offer["zero"]
        span = f"{zero['t_start'][:19]}Z to {zero['t_end'][:19]}Z"
        lines.append(f"a tare now would take off {_zero_text(zero)}, weighed {span}{_advice(zero)}")
    else:
        lines.append(f"no tare now ({offer['reason']}): {offer['detail']}")
    lines += [f"  {_tare_text(entry)}{end_text(entry['ended'])}" for entry in state["history"]]
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
    return f"{payload} and {share} (95 %) from {one_or_more(zero['n_batches'], 'batch', 'batches')}"
