"""The fleet report over a year: its duration, its memory, and the size of its pages.

    python -m benchmarks.speed.fleet_report [--vehicles 100] [--days 365] [--hours 2] [--output FILE]

Makes a data set like that of `springscale reprocess`, with random numbers: a batch every five minutes of driving,
seasons that change the dampers of all vehicles, a few vehicles that drift, a few with a failing sensor. The report runs
in a process of its own; memory is compared with that of a tenth of the vehicles.
"""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speed.meter import print_and_write, springscale
from gateway.archive.dataset import schema
from gateway.archive.receipts import Slot, text_of
from gateway.units import NS_PER_S

START_DAY = 20_454  # 2026-01-01
WINDOW_S = 300  # BatchSettings.window_s
DRIFTING_EVERY, FAILING_EVERY = 25, 40  # chosen: one vehicle in this many
PER_YEAR = 0.2  # chosen: drift of a damper
STD_KG, OWN_STD_KG = 8.0, 5.0


def write_dataset(folder: Path, n_vehicles: int, n_days: int, hours_a_day: float) -> int:
    """Tables and receipts, one a vehicle and month; returns how many batches they hold."""
    n_total = 0
    for n in range(n_vehicles):
        rng = np.random.default_rng([7, n])
        day = np.repeat(np.arange(n_days), round(hours_a_day * 3600 / WINDOW_S))
        months = (np.datetime64("1970-01-01") + START_DAY + day).astype("datetime64[M]")
        columns = _columns(rng, n, day)
        for month in np.unique(months):
            rows = months == month
            slot = Slot(f"van-{n:04}", str(month), f"{n:08x}{abs(int(month.astype(int))):024x}")
            _write(folder, slot, {name: _chosen(column, rows) for name, column in columns.items()})
        n_total += len(day)
    return n_total


def _columns(rng: np.random.Generator, n: int, day: Any) -> dict[str, Any]:
    """A vehicle's year; a tenth of its batches are refused, and all of a failing sensor's."""
    size, year = len(day), day / 365.25
    within = np.arange(size) % max(1, int(np.count_nonzero(day == 0)))
    t_end_ns = ((START_DAY + day) * 86_400 + 8 * 3600 + (within + 1) * WINDOW_S) * NS_PER_S
    is_refused = rng.random(size) < 0.1
    is_failing = (n % FAILING_EVERY == 1) & (year > 0.7) & (rng.random(size) < 0.8)
    loads = np.repeat(rng.uniform(0.0, 450.0, size // 6 + 1), 6)[:size]
    payload = np.where(is_refused | is_failing, np.nan, loads + rng.normal(0.0, OWN_STD_KG, size))
    own_drift = PER_YEAR * year if n % DRIFTING_EVERY == 2 else 0.0
    damper = 1.0 + 0.05 * np.sin(2.0 * np.pi * year) + own_drift
    rejected = [
        ["acceleration_stuck"] if failing else ["too_slow"] if refused else []
        for failing, refused in zip(is_failing, is_refused, strict=True)
    ]
    known = {
        "t_end_ns": t_end_ns,
        "payload_kg": payload,
        "payload_std_kg": np.where(np.isnan(payload), np.nan, STD_KG),
        "payload_own_std_kg": np.where(np.isnan(payload), np.nan, OWN_STD_KG),
        "damper_front_ratio": damper + rng.normal(0.0, 0.05, size),
        "damper_rear_ratio": 1.0 + 0.05 * np.sin(2.0 * np.pi * year) + rng.normal(0.0, 0.05, size),
        "delay_scale": rng.normal(0.0, 0.003, size),
        "misfit": rng.gamma(100.0, 0.01, size),
        "tension": rng.chisquare(5, size),
        "sensor_position_score": rng.normal(0.0, 1.0, size),
        "sensor_noise_score": rng.normal(0.0, 1.0, size),
    }
    return {**known, "rejected": rejected, "over_limit": [["gross"] if load > 440.0 else [] for load in loads]}


def _chosen(column: Any, rows: Any) -> Any:
    return (
        column[rows]
        if isinstance(column, np.ndarray)
        else [one for one, is_in in zip(column, rows, strict=True) if is_in]
    )


def _write(folder: Path, slot: Slot, columns: dict[str, Any]) -> None:
    import pyarrow as pa  # noqa: PLC0415 - an extra
    import pyarrow.parquet as pq  # noqa: PLC0415 - likewise

    n, table = len(columns["t_end_ns"]), schema()
    columns |= {"vehicle_id": [slot.vehicle] * n, "calibration_id": ["sha256:1"] * n, "job": [slot.job] * n}
    columns |= {"estimator": ["cross_spectrum"] * n}
    arrays = [
        pa.array(columns[field.name], field.type, from_pandas=True)
        if field.name in columns
        else pa.nulls(n, field.type)
        for field in table
    ]
    for path in (folder / slot.table, folder / slot.receipt):
        path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.Table.from_arrays(arrays, schema=table), folder / slot.table, compression="zstd")
    (folder / slot.receipt).write_bytes(text_of({"vehicle": slot.vehicle, "month": slot.month, "job": slot.job}))


def report(dataset: Path, output: Path) -> dict[str, float]:
    """Wall time, processor time and peak memory of the command; what it wrote."""
    ran = springscale("fleet-report", dataset, "--output", output)
    pages = list((output / "vehicles").glob("*.html"))
    return {
        "seconds": ran["clock_s"],
        "cpu_s": ran["cpu_s"],
        "peak_mb": ran["peak_mb"],
        "page_kb": (output / "report.html").stat().st_size / 1e3,
        "vehicle_page_kb": sum(page.stat().st_size for page in pages) / max(1, len(pages)) / 1e3,
    }


def measure(vehicles: int, days: int, hours: float) -> dict[str, Any]:
    """A report on a tenth of the vehicles, and on all of them."""
    figures: dict[str, Any] = {"vehicles": vehicles, "days": days, "hours_a_day": hours}
    with tempfile.TemporaryDirectory() as name:
        for part, n_vehicles in (("tenth", max(1, vehicles // 10)), ("whole", vehicles)):
            dataset = Path(name) / f"dataset-{part}"
            n_batches = write_dataset(dataset, n_vehicles, days, hours)
            figures[part] = {"batches": n_batches, **report(dataset, Path(name) / f"report-{part}")}
    return figures


if __name__ == "__main__":
    print_and_write(__doc__, measure, vehicles=100, days=365, hours=2.0)
