"""A commissioning in sentences."""

from typing import Any, Final

from gateway.words import one_or_more

STEPS: Final = {
    "line": "choose the line that this vehicle is of",
    "vehicle": "state its axle weights, wheelbase, and the sensor's position",
    "empty": "state that it is empty, and drive",
    "drive": "drive, empty, on any ordinary road above 20 km/h",
    "fit": "the calibration is being made",
}


def state_text(state: dict[str, Any]) -> str:
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


def underway_text(underway: dict[str, Any]) -> str:
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


def doubts_text(doubts: list[dict[str, Any]]) -> str:
    """The doubts, one line each, and the answers that were probably meant."""
    lines = [f"is this right? {one['text']}: {one['advice']}" for one in doubts]
    meant = doubts[0]["meant"]
    said = " and ".join(f"{name} = {x[1] if isinstance(x, list) else x:g}" for name, x in meant.items())
    return "\n".join([*lines, *([f"did you mean {said}?"] if said else [])])


def progress_text(underway: dict[str, Any]) -> str:
    """One line, while it is driven."""
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


def lines_text(items: list[dict[str, Any]]) -> str:
    """The lines with numbers to choose from."""
    if not items:
        return "there is no line: `springscale commission upload FILE` adds one, or continue without"
    return "\n".join(
        f"{n}: {item['name']} ({item['source']}): {item['fault'] or _line_text(item['vehicle'])}"
        for n, item in enumerate(items, 1)
    )


def _line_text(vehicle: dict[str, Any]) -> str:
    return f"{vehicle['name']}, wheelbase {vehicle['wheelbase_m']:g} m"


def _made_text(made: dict[str, Any]) -> str:
    line = f"of the line {made['line']['name']}" if made["line"]["name"] else "without a line"
    note = f" ({made['note']})" if made["note"] else ""
    windows = one_or_more(made["n_batches"], "window", "windows")
    return f"{made['id'][:19]} {made['vehicle_name']} {line}, {windows}, made {made['at'][:19]}Z by {made['by']}{note}"


def end_text(ended: dict[str, Any] | None) -> str:
    """When and why a calibration went out of use, and who said so; empty for the one in use."""
    return "" if ended is None else f", {ended['why']} {ended['at'][:19]}Z by {ended['by']}"
