"""A campaign on disk: logs of the half-car of support.half_car_road driving known loads, and its campaign.toml."""

import json
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path

import numpy as np

from gateway.bus.logs import write_candump
from gateway.bus.signals import load_signal_map
from gateway.core.vehicle import Vehicle, front_share_pct
from gateway.records import Signal
from support.encoded import encode_signals
from support.half_car_road import VAN, batch_over_road
from support.known_runs import LOADS

START_NS = 1_790_000_000_000_000_000
STEP_NS = 20_000_000
SIGNALS = "springscale:reference"

Load = tuple[float, float | None]  # payload in kg, metres behind the front axle


def write_known_loads(
    directory: Path,
    loads: tuple[Load, ...] = LOADS,
    duration_s: float = 300.0,
    identification_fraction: float = 0.667,
    *,
    has_pitch_rate: bool = True,
) -> Path:
    """The path of campaign.toml. With windows of 100 s each run has two batches to identify and one to validate."""
    (directory / "signals.toml").write_text(_signals(has_pitch_rate), encoding="utf-8")
    lines = [
        'signals = "signals.toml"',
        f"identification_fraction = {identification_fraction}",
        "[vehicle]",
        'name = "van"',
        f"empty_mass_kg = {VAN.empty_mass_kg}",
        f"wheelbase_m = {VAN.wheelbase_m}",
        f"empty_front_share_pct = {VAN.empty_front_share_pct}",
        f"sensor_position_m = {VAN.sensor_position_m}",
    ]
    for number, (payload_kg, position_m) in enumerate(loads, 1):
        log = f"{number:02d}.log"
        _write_drive(directory / log, number, payload_kg, front_share_pct(VAN, payload_kg, position_m), duration_s)
        place = [] if position_m is None else [f"payload_position_m = {position_m}"]
        lines += ["[[runs]]", f'log = "{log}"', f"payload_kg = {payload_kg}", *place]
    path = directory / "campaign.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _signals(has_pitch_rate: bool) -> str:
    """The shipped reference map, or all of it but the pitch rate."""
    shipped = files("gateway.dbc")
    head, *tables = (shipped / "reference.toml").read_text(encoding="utf-8").split("[signals.")
    head = head.replace("springscale_reference.dbc", str(shipped / "springscale_reference.dbc"))
    kept = [table for table in tables if has_pitch_rate or not table.startswith("pitch_rate]")]
    return "[signals.".join([head, *kept])


def _write_drive(path: Path, number: int, payload_kg: float, share_pct: float, duration_s: float) -> None:
    batch = batch_over_road(payload_kg, share_pct, seed=number, duration_s=duration_s)
    rng = np.random.default_rng(1000 + number)
    t_ns = START_NS + number * 10**13 + np.arange(len(batch.speed_mps)) * STEP_NS
    stamps = {Signal.VERTICAL_ACCELERATION: t_ns, Signal.PITCH_RATE: t_ns, Signal.SPEED: t_ns[::10]}
    samples = {
        Signal.VERTICAL_ACCELERATION: 9.81 + batch.vertical_acceleration_mps2,
        Signal.PITCH_RATE: batch.pitch_rate_radps,
        Signal.SPEED: batch.speed_mps[::10] + 0.05 * rng.standard_normal(len(t_ns[::10])),
    }
    write_candump(encode_signals(load_signal_map(SIGNALS), stamps, samples), "can0", path)


def van_toml(folder: Path, vehicle: Vehicle) -> Path:
    """A vehicle as a file of `springscale learn`."""
    told = {name: value for name, value in asdict(vehicle).items() if value is not None}
    lines = [
        f"{name} = {json.dumps(list(value) if isinstance(value, tuple) else value)}" for name, value in told.items()
    ]
    path = folder / "van.toml"
    path.write_text("\n".join(["[vehicle]", *lines, ""]))
    return path
