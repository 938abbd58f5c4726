"""From a vehicle's Springscale into Traccar: each weight as attributes of the vehicle that Traccar already tracks.

    feeder.py http://127.0.0.1:8000 http://traccar.example:5055 356307042441013 /var/lib/springscale-traccar

A recipe to copy: Python alone. It asks the service (SPRINGSCALE_TOKEN) for what is new, sends it in order by Traccar's
OsmAnd protocol (parameters of a request; numbers become attributes of the last known place; 400: no such device), and
keeps its place in the folder once Traccar has answered 200. It begins with the oldest weight that the service has.
"""

import json
import os
import sys
import time
import urllib.error
import urllib.request
from datetime import datetime
from pathlib import Path
from urllib.parse import urlencode

WEIGHTS = {"gross": "grossWeight", "front_axle": "axleWeight1", "rear_axle": "axleWeight2"}


def parameters(record: dict, device: str) -> dict[str, str] | None:
    """What Traccar is sent of one estimate; None where nothing was weighed. What is unknown is left out, never 0."""
    if record["rejected"] or record["payload_kg"] is None:
        return None
    weights = {name: (record.get("weights") or {}).get(key) or {} for key, name in WEIGHTS.items()}
    told = {"payload": record["payload_kg"], "payloadStd": record["payload_std_kg"]}
    told |= {"frontShare": record["front_share_pct"]} | {name: weight.get("kg") for name, weight in weights.items()}
    known = {name: f"{number:.1f}" for name, number in told.items() if number is not None}
    over = [name for name, weight in weights.items() if weight.get("is_over_limit")]
    alarm = {"alarm": "general", "overload": " ".join(over)} if over else {}
    at_s = int(datetime.fromisoformat(record["t_end"]).timestamp())
    return {"id": device, "timestamp": str(at_s), **known, **alarm}


def asked(url: str, method: str = "GET") -> bytes:
    token = os.environ.get("SPRINGSCALE_TOKEN")
    headers = {"Authorization": f"Bearer {token}"} if token and method == "GET" else {}
    request = urllib.request.Request(url, headers=headers, method=method)
    with urllib.request.urlopen(request, timeout=10.0) as answer:
        return answer.read()


def feed_next(service: str, traccar: str, device: str, place: Path) -> bool:
    """Send the next record of the history, if there is one -> whether there is another."""
    cursor = {"cursor": place.read_text()} if place.exists() else {}
    page = json.loads(asked(f"{service}/api/v1/estimates?{urlencode({'spectra': 'false', 'limit': 1} | cursor)}"))
    for record in page["items"]:
        told = parameters(record, device)
        if told is not None:
            asked(f"{traccar}/?{urlencode(told)}", "POST")
        draft = place.with_suffix(".part")
        draft.write_text(page["next_cursor"] or page["last_cursor"])
        draft.replace(place)
    return page["next_cursor"] is not None


def main(service: str, traccar: str, device: str, folder: str, every_s: str = "10") -> None:
    """Feed until killed, with growing pauses after a fault."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    pause_s = float(every_s)
    while True:
        try:
            pause_s = 0.0 if feed_next(service, traccar, device, Path(folder) / "place") else float(every_s)
        except (OSError, ValueError, KeyError) as fault:
            is_unknown = isinstance(fault, urllib.error.HTTPError) and fault.code == 400
            what = f"{traccar} does not know the device {device}: add it there" if is_unknown else fault
            print(f"traccar feeder: {what}", file=sys.stderr, flush=True)
            pause_s = min(2.0 * pause_s + 0.1, 60.0)
        time.sleep(pause_s)


if __name__ == "__main__":
    main(*sys.argv[1:])
