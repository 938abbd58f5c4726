"""The accuracy of a phone beside a CAN IMU on the same drives: three known loads calibrate, others are judged.

Every van of gateway.sim.vans is driven in each round: empty and with two known loads to calibrate, then with three
others. Both sensors are at the same place in the same drive. The phone's recording is exported in an app's format and
imported by ``springscale import``; all further steps use the command line, as for any log. One app is enough: the
others' exports become the same log except for rounding (tests/unit/test_phone_import.py).
"""

import json
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from click.testing import CliRunner

from benchmarks.accuracy.markdown import Column, Row, page, table_of, text
from benchmarks.accuracy.study import Study
from gateway.bus.logs import write_candump
from gateway.cli import springscale
from gateway.offline.phone import import_recording
from gateway.sim.drive import rural, urban
from gateway.sim.obstacles import UnevenRoad
from gateway.sim.road import iso_road
from gateway.sim.scenario import simulate_drive
from gateway.sim.sensors import REFERENCE
from gateway.sim.vans import VANS
from gateway.sim.vehicle import Load, Vehicle
from gateway.workbench.campaigns import share_range_pct
from gateway.workbench.phones import PHONE, Lying, write_export
from gateway.workbench.wiring import Wiring

SEED: Final = 20_280  # arbitrary, of this study alone
CAN: Final = "CAN IMU"
BY_PHONE: Final = "phone"
APP: Final = "sensor_logger_android"
KNOWN: Final = ((0.0, 0.5), (0.35, 0.45), (0.8, 0.8))  # chosen: share of the rated payload, of the wheelbase
JUDGED: Final = ((0.2, 0.6), (0.5, 0.7), (0.7, 0.5))  # chosen, likewise


Batches = dict[str, list[dict[str, Any]]]  # by sensor


def of_one_round(seed: int, number: int) -> Batches:
    """One van in one round: the judged batches of both sensors."""
    van = [*VANS.values()][number % len(VANS)]
    drives = np.random.SeedSequence([seed, number % len(VANS), number // len(VANS)]).spawn(len(KNOWN + JUDGED))
    with tempfile.TemporaryDirectory() as folder:
        for i, one in enumerate(drives):
            _drive(Path(folder), van, i, int(one.generate_state(1)[0]))
        return {name: _judged(Path(folder) / name, van) for name in (CAN, BY_PHONE)}


def numbers(seed: int, n: int, rounds: Sequence[Batches]) -> dict[str, Any]:
    """Figures of both sensors over all vans and rounds."""
    batches = {name: [one for each in rounds for one in each[name]] for name in (CAN, BY_PHONE)}
    rows = [{"sensor": name, **_figures(each)} for name, each in batches.items()]
    return {"seed": seed, "n_rounds": n, "n_vans": len(VANS), "rows": rows}


def _drive(folder: Path, van: Vehicle, i: int, seed: int) -> None:
    """Simulate one drive, recorded by both sensors, and write its logs."""
    rng = np.random.default_rng(seed)
    drive = urban(330.0, rng).then(rural(640.0, rng))
    road = UnevenRoad(iso_road("B"), stretch_m=600.0, spread=0.25)
    loads = _loads(van, (KNOWN + JUDGED)[i])
    can = replace(REFERENCE, mount=replace(PHONE.mount, roll_deg=1.0, pitch_deg=-1.5, yaw_deg=2.0))
    recorded = simulate_drive(van, loads, road, drive, can, seed).recording
    (folder / CAN).mkdir(exist_ok=True)
    write_candump(Wiring("reference").frames_of(recorded), "can0", folder / CAN / f"{i}.log.gz")
    by_phone = simulate_drive(van, loads, road, drive, PHONE, seed).recording
    (folder / BY_PHONE).mkdir(exist_ok=True)
    export = folder / f"{i}.zip"
    write_export(by_phone, export, APP, Lying(), seed)
    import_recording(export, folder / BY_PHONE / f"{i}.log.gz")


def _loads(van: Vehicle, wanted: tuple[float, float]) -> tuple[Load, ...]:
    part, place = wanted
    return (Load(part * van.rated_payload_kg, place * van.wheelbase_m),) if part else ()


def _judged(folder: Path, van: Vehicle) -> list[dict[str, Any]]:
    """Batches of the drives that calibration has not seen, as ``evaluate --json`` prints them."""
    campaign = folder / "campaign.toml"
    campaign.write_text(_campaign(folder.name, van), encoding="utf-8")
    calibration = folder / "vehicle.json"
    _run("calibrate", str(campaign), "--output", str(calibration), "--estimator", "cross_spectrum")
    evaluated = json.loads(_run("evaluate", str(campaign), "--calibration", str(calibration), "--json"))
    batches: list[dict[str, Any]] = evaluated["batches"]
    return [{**batch, "rated_kg": van.rated_payload_kg} for batch in batches]


def _run(*arguments: str) -> str:
    result = CliRunner().invoke(springscale, list(arguments), catch_exceptions=False)
    if result.exit_code:
        raise RuntimeError(f"springscale {' '.join(arguments)}: {result.output}")
    return result.stdout


def _campaign(name: str, van: Vehicle) -> str:
    low, high = share_range_pct(van)
    mount = PHONE.mount
    lines = [
        f'signals = "springscale:{"reference" if name == CAN else "phone"}"',
        "[vehicle]",
        f'name = "{van.name}"',
        f"empty_mass_kg = {van.sprung_kg}",
        f"wheelbase_m = {van.wheelbase_m}",
        f"empty_front_share_pct = {van.empty_front_share_pct:.6g}",
        f"sensor_position_m = {mount.position_m}",
        f"sensor_offset_left_m = {mount.left_m}",
        f"track_width_m = {(van.front.track_m + van.rear.track_m) / 2.0:.6g}",
        f"payload_range_kg = [0.0, {van.rated_payload_kg}]",
        f"front_share_range_pct = [{low}, {high}]",
    ]
    for i, (part, place) in enumerate(KNOWN + JUDGED):
        lines += ["[[runs]]", f'log = "{i}.log.gz"', f"payload_kg = {part * van.rated_payload_kg:g}"]
        lines += [f"payload_position_m = {place * van.wheelbase_m:g}"] if part else []
        lines += [f'split = "{"identification" if i < len(KNOWN) else "validation"}"']
    return "\n".join(lines) + "\n"


def _figures(batches: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Errors and half-widths of all answered batches, kg and percentage points."""
    whole = [one for one in batches if "too_short" not in one["rejected"]]
    answered = [one for one in whole if not one["rejected"]]
    figures: dict[str, Any] = {"n_batches": len(whole), "n_rejected": len(whole) - len(answered)}
    for quantity, unit, of in (("payload", "kg", "rated_kg"), ("front_share", "pct", None)):
        judged = [
            (one[f"{quantity}_{unit}"], one[f"true_{quantity}_{unit}"], one[f"{quantity}_interval95_{unit}"])
            for one in answered
        ]
        errors = np.array([estimate - true for estimate, true, _ in judged])
        half = np.array([(high - low) / 2.0 for _, _, (low, high) in judged])
        held = np.array([low <= true <= high for _, true, (low, high) in judged])
        figures[quantity] = {
            f"mean_abs_{unit}": float(np.mean(np.abs(errors))),
            f"half_width_{unit}": float(np.mean(half)),
            "coverage95": float(np.mean(held)),
        }
        if of:
            rated = np.array([one[of] for one in answered])
            figures[quantity]["mean_abs_pct_of_rated"] = float(100.0 * np.mean(np.abs(errors) / rated))
    return figures


def _held(quantity: str) -> Callable[[Row], str]:
    return lambda row: f"{100 * row[quantity]['coverage95']:.0f} %"


def _payload_error(row: Row) -> str:
    found = row["payload"]
    return f"{found['mean_abs_kg']:.1f} kg ({found['mean_abs_pct_of_rated']:.1f} %)"


COLUMNS: Final[tuple[Column, ...]] = (
    ("Sensor", text("sensor")),
    ("Batches", text("n_batches")),
    ("Refused", text("n_rejected")),
    ("Payload, mean abs. error (of the rated)", _payload_error),
    ("Half-width (95 %)", lambda row: f"± {row['payload']['half_width_kg']:.1f} kg"),
    ("Held", _held("payload")),
    ("Front share, mean abs. error", lambda row: f"{row['front_share']['mean_abs_pct']:.2f} pp"),
    ("Half-width (95 %)", lambda row: f"± {row['front_share']['half_width_pct']:.2f} pp"),
    ("Held", _held("front_share")),
)


def phones_page(found: Mapping[str, Any]) -> str:
    """The page phone_accuracy.md from the numbers alone."""
    n = found["n_vans"] * found["n_rounds"]
    return page(
        "A phone beside a CAN IMU",
        f"phones --rounds {found['n_rounds']} --seed {found['seed']} --output DIR",
        f"{found['n_vans']} vans, each calibrated {found['n_rounds']} times ({n} calibrations) on an empty drive "
        "and two known loads, then judged on three drives with other loads; 15 minutes a drive, town and country. "
        "Phone and CAN IMU lie at the same place on the floor of the same drives. The phone has a phone's noise, "
        "rate (100 Hz, a fix a second), clock and GPS gaps, lies turned by 130 degrees, and is in a hand for the "
        "first and last 15 seconds; its recording goes through Sensor Logger's format and `springscale import`, "
        "which makes the same log of every app's. The simulated floor is rigid: a phone on a carpet, or one that "
        "slides, will do worse. No real phone has been tried yet.",
        "",
        *table_of(COLUMNS, found["rows"]),
        "",
        note="Everything is simulated.",
    )


def _n_vans(n_rounds: int) -> int:
    return n_rounds * len(VANS)


STUDY: Final = Study(
    name="phones",
    does="The accuracy of a phone beside a CAN IMU on the same drives; ~2 minutes a round.",
    doing="driving vans with a phone on the floor",
    of_case=of_one_round,
    numbers=numbers,
    page=phones_page,
    seed=SEED,
    n=2,
    counts="rounds",
    least=1,
    n_cases=_n_vans,
    file="phone_accuracy",
)
