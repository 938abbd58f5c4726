"""springscale commission: calibrate a running service's vehicle from an empty drive. The service does the work."""

import sys
import time
from typing import Any, Final

import click

from gateway.cli.options import NUMBER, as_json
from gateway.cli.progress import StatusLine
from gateway.cli.service import Answer, Service, asks_service, prints_answer
from gateway.core.vehicle import Carries
from gateway.errors import SpringscaleError
from gateway.records import json_line
from gateway.words import one_or_more

STEPS: Final = {
    "vehicle": "state its axle weights, wheelbase, and the sensor's position",
    "empty": "state that it is empty, and drive",
    "drive": "drive, empty, on any ordinary road above 20 km/h",
    "fit": "the calibration is being made",
}


def state_text(state: Answer) -> str:
    """The commissioning under way, the calibration in use, and earlier ones."""
    lines = [f"in use: {_made_text(state['active']) if state['active'] else 'the calibration of the settings, if any'}"]
    if state["is_pending"]:
        lines.append("another calibration counts from the next drive on")
    if state["underway"] is not None:
        lines.append(underway_text(state["underway"]))
    elif state["why_not"]:
        lines.append(f"no calibration can be made here: {state['why_not']}")
    else:
        lines.append("nothing is under way: `springscale commission start` begins")
    lines += [f"  {_made_text(made)}{end_text(made['ended'])}" for made in state["history"]]
    return "\n".join(lines)


def underway_text(underway: Answer) -> str:
    """The next step, the findings of inspection, the progress."""
    lines = [f"next: {STEPS[underway['step']]}"]
    if underway["n_batches"] or underway["driven_s"]:
        lines.append(progress_text(underway))
    if underway["doubts"]:
        lines.append(doubts_text(underway["doubts"]))
        lines.append("`springscale commission confirm` if it is right all the same")
    if any(one["is_of_drive"] for one in underway["doubts"]):
        lines.append("`springscale commission again` if it was not empty, but is now")
    if underway["fault"]:
        lines.append(f"no calibration yet: {underway['fault']}")
    inspection = underway["inspection"] or {"findings": []}
    lines += [f"{one['severity']}: {one['kind']}: {one['text']}: {one['advice']}" for one in inspection["findings"]]
    return "\n".join(lines)


def doubts_text(doubts: list[Answer]) -> str:
    """The doubts, one line each, and the answers that were probably meant."""
    lines = [f"is this right? {one['text']}: {one['advice']}" for one in doubts]
    meant = doubts[0]["meant"]
    said = " and ".join(f"{name} = {x[1] if isinstance(x, list) else x:g}" for name, x in meant.items())
    return "\n".join([*lines, *([f"did you mean {said}?"] if said else [])])


def progress_text(underway: Answer) -> str:
    driven = f"{underway['driven_s'] / 60.0:.0f} min driven, {one_or_more(underway['n_batches'], 'window', 'windows')}"
    learned, next_s = underway["learned"], underway["next_window_s"]
    if next_s is not None:
        driven += f", next window in {int(next_s) // 60}:{int(next_s) % 60:02}"
    if learned is None:
        return f"{driven}: no result yet"
    return (
        f"{driven}: {learned['share']:.0%} of the goal; payload to ± {learned['payload_std_kg']:.0f} kg, goal ± "
        f"{learned['needed_std_kg']:.0f} kg (standard deviations)"
    )


def _made_text(made: Answer) -> str:
    sister = f"like {made['sister']}" if made["sister"] else "like any vehicle"
    note = f" ({made['note']})" if made["note"] else ""
    windows = one_or_more(made["n_batches"], "window", "windows")
    return (
        f"{made['id'][:19]} {made['vehicle_name']} {sister}, {windows}, made {made['at'][:19]}Z by {made['by']}{note}"
    )


def end_text(ended: Answer | None) -> str:
    """When and why a calibration went out of use, and who said so; empty for the one in use."""
    return "" if ended is None else f", {ended['why']} {ended['at'][:19]}Z by {ended['by']}"


PATH: Final = "/api/v1/calibration/commissioning"
LOOK_EVERY_S: Final = 5.0  # chosen: seconds between two looks at the progress
MOST_UNANSWERED: Final = 6  # chosen: looks, half a minute: a restart with another calibration takes seconds
MOST_PAYLOAD: Final = "payload_range_kg"
SAID: Final = {  # option: key of the vehicle, question, whether it must be answered
    "front_axle_kg": ("kerb_front_axle_kg", "Under the front axle, empty [kg]", True),
    "rear_axle_kg": ("kerb_rear_axle_kg", "Under the rear axle, empty [kg]", True),
    "wheelbase_m": ("wheelbase_m", "Wheelbase [m]", True),
    "sensor_m": ("sensor_position_m", "Sensor behind the front axle [m]", True),
    "sensor_left_m": ("sensor_offset_left_m", "", False),
    "track_m": ("track_width_m", "", False),
    "payload_kg": (MOST_PAYLOAD, "", False),
    "carries": ("carries", "", False),
    "payload_length_m": ("payload_length_m", "", False),
    "payload_height_m": ("payload_height_m", "", False),
    "roof_rack": ("roof_rack", "", False),
    "tow_bar": ("tow_bar", "", False),
    "name": ("name", "", False),
}


@click.group("commission")
def commission() -> None:
    """Calibrate the vehicle of a running service from its axle weights and an empty drive."""


@commission.command("start")
@click.option("--name", default=None, help="name of the vehicle [default: its id]")
@click.option("--front-axle-kg", type=NUMBER, default=None, help="under the front axle of the empty vehicle")
@click.option("--rear-axle-kg", type=NUMBER, default=None, help="the same at the rear")
@click.option("--wheelbase-m", type=NUMBER, default=None, help="from axle to axle")
@click.option("--sensor-m", type=NUMBER, default=None, help="sensor behind the front axle; negative: ahead of it")
@click.option(
    "--sensor-left-m", type=NUMBER, default=None, help="sensor left of the centre line; negative: right of it"
)
@click.option("--track-m", type=NUMBER, default=None, help="between the middles of left and right tyres")
@click.option("--payload-kg", type=NUMBER, default=None, help="maximum payload [default: as its sister, else 450]")
@click.option(
    "--carries", type=click.Choice([str(one) for one in Carries]), default=None, help="what it usually carries"
)
@click.option("--payload-length-m", type=NUMBER, default=None, help="usual length of the load along the floor")
@click.option("--payload-height-m", type=NUMBER, default=None, help="usual height of the load above the floor")
@click.option("--roof-rack", is_flag=True, default=None, help="part of the load may be on the roof")
@click.option("--tow-bar", is_flag=True, default=None, help="part of the load may be on a tow bar")
@click.option(
    "--empty", is_flag=True, help="you know that the vehicle is empty, and will be until the calibration is made"
)
@click.option("--sure", is_flag=True, help="confirm the answers in question")
@click.option("--note", default=None, help="kept in the history")
@click.option("--follow/--no-follow", default=None, help="show progress until it is made [default: at a terminal]")
@asks_service
@as_json
def start(
    service: Service,
    empty: bool,
    sure: bool,
    note: str | None,
    follow: bool | None,
    as_json: bool,
    **said: Any,
) -> None:
    """Begin, or continue a commissioning under way. On a terminal the command asks for answers that no option gives."""
    state = service.ask(PATH)
    if state["underway"] is None:
        state = service.ask(PATH, "POST", {} if note is None else {"note": note})
    if any(answer is not None for answer in said.values()) or state["underway"]["vehicle"] is None:
        state = service.ask(f"{PATH}/vehicle", "POST", _vehicle(said))
    if doubts := state["underway"]["doubts"]:
        if not (sure or (_is_at_terminal() and click.confirm(f"{doubts_text(doubts)}\nIs it right all the same?"))):
            raise SpringscaleError(f"{doubts_text(doubts)}\ncorrect the answers, or say --sure; all answers are kept")
        state = service.ask(f"{PATH}/confirm", "POST", {})
    if state["underway"]["step"] == "empty":
        if not (empty or (_is_at_terminal() and click.confirm("Is the vehicle empty, driver and tank as in service?"))):
            raise SpringscaleError("say --empty once the vehicle is empty; all answers are kept")
        state = service.ask(f"{PATH}/empty", "POST", {"is_empty": True})
    if as_json:
        click.echo(json_line(state))
        return
    click.echo(state_text(state))
    if _is_at_terminal() if follow is None else follow:
        _follow(service)


@commission.command("show")
@prints_answer(state_text)
def show(service: Service) -> Answer:
    """The commissioning under way, the findings of inspection, the progress, and earlier calibrations."""
    return service.ask(PATH)


def _add_step(name: str, words: str, method: str, step: str = "", body: Answer | None = None) -> None:
    """A command without options of its own: one request, which answers with the new state."""

    @commission.command(name, help=words)
    @prints_answer(state_text)
    def request(service: Service) -> Answer:
        return service.ask(PATH + step, method, body)


_add_step("fit", "Calibrate with the data so far, whether sufficient or not.", "POST", "/fit", {})
_add_step(
    "confirm",
    "Confirm the answers in question; if the drive contradicted them, its calibration is used.",
    "POST",
    "/confirm",
    {},
)
_add_step(
    "again",
    "The vehicle was not empty, but is now: discard the drive, and begin the empty drive again.",
    "POST",
    "/empty",
    {"is_empty": True, "again": True},
)
_add_step("cancel", "Discard the commissioning under way; earlier calibrations stay.", "DELETE")


@commission.command("undo")
@click.option("--factory", is_flag=True, help="all that were made here: back to the calibration of the settings")
@prints_answer(state_text)
def undo(service: Service, factory: bool) -> Answer:
    """Take the last calibration made here out of use; the one before it counts from the next drive on."""
    return service.ask(f"{PATH}/undo" + ("?to=factory" if factory else ""), "POST", {})


def _is_at_terminal() -> bool:
    return sys.stdin.isatty()


def _vehicle(said: Answer) -> Answer:
    """The answers; missing ones that are needed are asked for."""
    vehicle = {}
    for option, (key, question, is_needed) in SAID.items():
        answer = said[option]
        if answer is None and is_needed:
            if not _is_at_terminal():
                raise click.UsageError(f"say --{option.replace('_', '-')}: the vehicle needs it")
            answer = click.prompt(question, type=NUMBER)
        if answer is not None:
            vehicle[key] = [0.0, answer] if key == MOST_PAYLOAD else answer
    return vehicle


def _follow(service: Service) -> None:
    """Show progress until the calibration is made; Ctrl-C only ends the display."""
    with StatusLine() as status:
        n_unanswered = 0
        while True:
            try:
                state = service.ask(PATH)
                n_unanswered = 0
            except SpringscaleError:  # between two drives the service restarts
                n_unanswered += 1
                if n_unanswered > MOST_UNANSWERED:
                    raise
                time.sleep(LOOK_EVERY_S)
                continue
            if state["underway"] is None:
                break
            status.show(progress_text(state["underway"]))
            if any(one["is_of_drive"] for one in state["underway"]["doubts"]):
                raise SpringscaleError(underway_text(state["underway"]))
            if state["underway"]["fault"] or (state["underway"]["inspection"] or {}).get("has_fault"):
                raise SpringscaleError(underway_text(state["underway"]))
            time.sleep(LOOK_EVERY_S)
    click.echo(state_text(state))
