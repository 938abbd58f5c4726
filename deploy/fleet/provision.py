"""A fleet's table to one folder a vehicle, and to the passwords of the broker. Needs Python alone.

    python3 provision.py fleet.csv --settings settings.toml --broker broker.fleet.example --output out

fleet.csv has a line a vehicle: ``id`` and ``vin``, ``calibration`` and ``signals`` where a vehicle has a file of its
own (paths as seen from the table), and any other key of ``[vehicle]`` by its name, as gross_limit_kg. settings.toml is
what all share, without [vehicle] and [uplink]. Running it again keeps every password, adds who is new, and takes away
who is gone: out/passwords is the broker's whole list.
"""

import argparse
import base64
import csv
import hashlib
import json
import os
import re
import secrets
import shutil
import sys
import tomllib
from pathlib import Path
from typing import Final

SUBSCRIBER: Final = "fleet-subscriber"
DISPATCHER: Final = "fleet-dispatcher"  # states loads to the vehicles
FILES: Final = ("calibration", "signals")
REPEAT_S: Final = 120  # four times what mosquitto.conf takes to save
_ROUNDS: Final = 101  # mosquitto's own, for passwords that people choose; these have 256 bits of chance
_NAME: Final = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")  # safe in a topic, in the broker's list and as a folder


class FleetError(Exception):
    """The table or the settings cannot be used."""


def provision(
    table: Path, settings: Path, broker: str, ca: Path | None, output: Path, *, hear: bool = False
) -> list[str]:
    """Write all folders and the list -> ids of the vehicles. Raises FleetError naming the line.

    ``hear``: vehicles take statements of loads from the broker.
    """
    shared = _shared_settings(settings)
    vehicles = _vehicles(table)
    passwords = {name: _password(output / "vehicles" / name / "broker-password") for name in vehicles}
    passwords[SUBSCRIBER] = _password(output / "subscriber" / "broker-password")
    passwords[DISPATCHER] = _password(output / "dispatcher" / "broker-password")
    for name, vehicle in vehicles.items():
        folder = output / "vehicles" / name
        own = {key: _copied(table.parent / vehicle[key], folder) for key in FILES if vehicle.get(key)}
        if ca is not None:
            shutil.copyfile(ca, folder / "fleet-ca.pem")
        text = _configuration(shared, own, vehicle, broker, has_ca=ca is not None, hear=hear)
        try:
            tomllib.loads(text)
        except tomllib.TOMLDecodeError as fault:
            raise FleetError(f"{settings} and the line of {name} do not fit together: {fault}") from None
        (folder / "springscale.toml").write_text(text, encoding="utf-8")
    for folder in (output / "vehicles").iterdir():
        if folder.name not in vehicles:
            shutil.rmtree(folder)
    _write_secret(output / "passwords", _list_of(passwords, output / "passwords"))
    return list(vehicles)


def _vehicles(table: Path) -> dict[str, dict[str, str]]:
    found: dict[str, dict[str, str]] = {}
    vins: set[str] = set()
    with table.open(encoding="utf-8", newline="") as lines:
        for number, line in enumerate(csv.DictReader(lines), start=2):
            name, vin = line.get("id") or "", line.get("vin") or ""
            if not _NAME.fullmatch(name) or name in (SUBSCRIBER, DISPATCHER):
                raise FleetError(f"{table}: line {number}: id {name!r}: 1 to 64 of A-Z a-z 0-9 . _ -")
            if name in found or vin in vins:
                raise FleetError(f"{table}: line {number}: {name} or its VIN {vin} stands there twice")
            found[name] = {key: cell for key, cell in line.items() if key and cell}
            vins |= {vin} if vin else set()
    if not found:
        raise FleetError(f"{table}: no vehicle; its first line must name the columns id and vin")
    return found


def _shared_settings(path: Path) -> str:
    text = path.read_text(encoding="utf-8")
    for own in ("vehicle", "uplink"):
        if own in tomllib.loads(text):
            raise FleetError(f"{path}: [{own}] is written for each vehicle: leave it out")
    return text


def _configuration(
    shared: str, own: dict[str, str], vehicle: dict[str, str], broker: str, *, has_ca: bool, hear: bool
) -> str:
    """The file of one vehicle: its own files before all that is shared, which may end in a table."""
    top = [f"{key} = {json.dumps(name)}" for key, name in own.items()]
    keys = {key: cell for key, cell in vehicle.items() if key not in FILES}
    numbers = {key for key in keys if key.endswith("_kg")}
    lines = [f"{key} = {cell if key in numbers else json.dumps(cell)}" for key, cell in keys.items()]
    host, _, port = broker.partition(":")
    uplink = [
        f"host = {json.dumps(host)}",
        *([f"port = {int(port)}"] if port else []),
        *(['ca = "fleet-ca.pem"'] if has_ca else []),
        f"username = {json.dumps(vehicle['id'])}",
        'password_file = "broker-password"',
        f"repeat_s = {REPEAT_S}",
        "wait_for_listener = true",
        *(["statements = true"] if hear else []),
    ]
    return "\n".join([*top, shared.rstrip(), "", "[vehicle]", *lines, "", "[uplink]", *uplink, ""])


def _copied(path: Path, folder: Path) -> str:
    """A vehicle's own file beside its settings; what is named springscale:... is shipped with the package."""
    if ":" in path.name:
        return path.name
    shutil.copyfile(path, folder / path.name)
    return path.name


def _password(path: Path) -> str:
    if path.exists():
        return path.read_text(encoding="ascii").strip()
    path.parent.mkdir(parents=True, exist_ok=True)
    _write_secret(path, secrets.token_urlsafe(32) + "\n")
    return _password(path)


def _list_of(passwords: dict[str, str], known: Path) -> str:
    """Lines as mosquitto_passwd writes them; one that still fits its password stays."""
    lines = dict(line.split(":", 1) for line in known.read_text().splitlines()) if known.exists() else {}
    kept = {name: lines[name] for name in passwords if name in lines and _fits(passwords[name], lines[name])}
    return "".join(f"{name}:{kept.get(name) or _hashed(word)}\n" for name, word in sorted(passwords.items()))


def _hashed(password: str, salt: bytes | None = None) -> str:
    """$7$rounds$salt$hash of Mosquitto 2.0: PBKDF2 with HMAC-SHA512."""
    salt = salt or secrets.token_bytes(12)
    digest = hashlib.pbkdf2_hmac("sha512", password.encode(), salt, _ROUNDS)
    return f"$7${_ROUNDS}${base64.b64encode(salt).decode()}${base64.b64encode(digest).decode()}"


def _fits(password: str, line: str) -> bool:
    return line == _hashed(password, base64.b64decode(line.split("$")[3]))


def _write_secret(path: Path, text: str) -> None:
    """At once or not at all, for its owner's eyes."""
    draft = path.with_name(f".{path.name}.new")
    with os.fdopen(os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w") as file:
        file.write(text)
    draft.replace(path)


def main() -> int:
    """0 done, 2 a table or settings that cannot be used."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("table", type=Path)
    asked.add_argument("--settings", type=Path, required=True, help="springscale.toml of all, without their own tables")
    asked.add_argument("--broker", required=True, help="host or host:port")
    asked.add_argument("--ca", type=Path, help="authority of the broker's certificate, where it is not a public one")
    asked.add_argument("--output", type=Path, required=True)
    asked.add_argument("--statements", action="store_true", help="vehicles take statements of loads from the broker")
    told = asked.parse_args()
    try:
        names = provision(told.table, told.settings, told.broker, told.ca, told.output, hear=told.statements)
    except (FleetError, OSError, ValueError) as fault:
        print(f"provision: {fault}", file=sys.stderr)
        return 2
    print(f"{len(names)} vehicles in {told.output / 'vehicles'}; the broker's list is {told.output / 'passwords'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
