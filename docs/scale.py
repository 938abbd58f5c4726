"""The tables of docs/scale.md, from measurements (footprint.json, fleet_report.json) and assumptions (scale.toml)."""

import tomllib
from collections.abc import Callable, Mapping
from typing import Any, Final

from made import DOCS, numbers, table
from vehicle_year import GB, Scale, duration, figure, in_bytes, limits_of

SIZES: Final = tuple(10**n for n in range(7))


def _measured(scale: Scale) -> str:
    found = scale.measured
    records, bus, uplink = found["records"], found["whole_bus"], found["uplink"]
    weighing, connection, report = found["weighing"], uplink["connections"], found["report"]
    rows = [
        ("A record as JSON, with its spectra", in_bytes(records["json_bytes"]["with_spectra"])),
        ("A record as JSON, without", in_bytes(records["json_bytes"]["without_spectra"])),
        ("A record in the vehicle's SQLite, spectra and indexes included", in_bytes(records["sqlite_bytes"])),
        ("A record more in a Parquet file, without spectra", in_bytes(records["parquet_bytes"]["per_record"])),
        ("A Parquet file before its first record", in_bytes(records["parquet_bytes"]["per_file"])),
        ("A receipt, and what each log adds to it", f"{in_bytes(records['receipt_bytes']['per_file'])}, "
         f"{in_bytes(records['receipt_bytes']['per_log'])}"),
        ("A message of the uplink on the wire, without TLS", in_bytes(uplink["wire_bytes_up"])),
        ("The broker's answer", in_bytes(uplink["wire_bytes_down"])),
        ("An hour of the mapped frames, candump .gz", in_bytes(found["mapped_frames"]["gz_bytes_per_hour"])),
        (f"An hour of a bus of {bus['frames_per_s']} frames/s, candump .gz", in_bytes(bus["gz_bytes_per_hour"])),
        ("The same as text", in_bytes(bus["text_bytes_per_hour"])),
        ("Reading candump text", f"{figure(bus['text_mframes_per_cpu_s'])} million frames a core second"),
        ("Reading candump .gz", f"{figure(bus['gz_mframes_per_cpu_s'])} million frames a core second"),
        ("Reading and weighing an hour of driving", f"{figure(weighing['cpu_s'] / weighing['hours'])} core seconds"),
        ("The same for each batch that was answered", f"{figure(1e3 * weighing['cpu_s_per_answer'])} ms"),
        ("A message at the broker, received and forwarded", f"{figure(uplink['cpu_us_per_message'])} µs"),
        ("A connection at the broker, TLS", f"{figure(connection['cpu_ms_each'])} ms once, "
         f"{in_bytes(connection['memory_bytes_each'])} while it is open"),
        (f"The report of {report['vehicles']} vehicles over {report['days']} days, "
         f"{report['whole']['batches']} batches",
         f"{figure(report['whole']['cpu_s'])} core seconds, {figure(report['whole']['peak_mb'])} MB"),
        ("The same of a tenth of them",
         f"{figure(report['tenth']['cpu_s'])} core seconds, {figure(report['tenth']['peak_mb'])} MB"),
        ("An additional vehicle in the report", f"{figure(scale.report_cpu_s)} core seconds, "
         f"{in_bytes(scale.report_memory_bytes)} of memory, {in_bytes(scale.report_page_bytes)} of the fleet's page"),
    ]  # fmt: skip
    return table(" | ", rows)


def _vehicle_year(scale: Scale) -> str:
    store, hour = scale.stored_cost, scale.price("core_hour")
    mobile = scale.price("mobile_data_per_gb")
    rows = [
        ("Records", figure(scale.records), ""),
        ("In the vehicle, SQLite (its size is bounded by `max_size_mb`)", in_bytes(scale.sqlite_bytes), ""),
        ("Uplink: sent to the broker", in_bytes(scale.uplink_bytes), figure(scale.uplink_bytes / GB * mobile)),
        ("Archive: Parquet", in_bytes(scale.parquet_bytes), figure(store(scale.parquet_bytes))),
        ("Archive: receipts, a log a day", in_bytes(scale.receipt_bytes), figure(store(scale.receipt_bytes))),
        (
            "Archive: files and receipts written",
            figure(scale.objects),
            figure(scale.objects / 1000.0 * scale.price("writes_per_1000")),
        ),
        ("Logs of the mapped frames", in_bytes(scale.mapped_log_bytes), figure(store(scale.mapped_log_bytes))),
        ("or logs of the whole bus", in_bytes(scale.bus_log_bytes), figure(store(scale.bus_log_bytes))),
        (
            "Reprocessing the year, mapped frames",
            f"{figure(scale.weighing_core_hours)} core hours",
            figure(scale.weighing_core_hours * hour),
        ),
        (
            "or from logs of the whole bus",
            f"{figure(scale.bus_core_hours)} core hours",
            figure(scale.bus_core_hours * hour),
        ),
    ]
    return f"{figure(scale.hours)} h of driving; storage is kept for a year.\n\n" + table(
        " | amount | cost by the example prices", rows
    )


def _fleets(scale: Scale) -> str:
    cores, night = scale.assumed["machine"]["cores"], scale.assumed["machine"]["night_hours"]
    connection = scale.measured["uplink"]["connections"]
    lines: list[tuple[str, Callable[[float], str]]] = [
        ("Records a year", lambda n: figure(n * scale.records)),
        ("Parquet a year", lambda n: in_bytes(n * scale.parquet_bytes)),
        ("Files and receipts a year", lambda n: figure(n * scale.objects)),
        ("Logs a year, mapped frames", lambda n: in_bytes(n * scale.mapped_log_bytes)),
        ("Logs a year, whole bus", lambda n: in_bytes(n * scale.bus_log_bytes)),
        ("Uplink a year", lambda n: in_bytes(n * scale.uplink_bytes)),
        ("Messages/s, mean", lambda n: figure(n * scale.messages_per_s_mean)),
        ("Messages/s, busiest moment", lambda n: figure(n * scale.messages_per_s_at_peak)),
        (
            "Broker cores at that moment",
            lambda n: _or_less(n * scale.messages_per_s_at_peak * scale.measured["uplink"]["cpu_us_per_message"] / 1e6),
        ),
        ("Broker memory for connections", lambda n: in_bytes(n * connection["memory_bytes_each"])),
        ("Core hours to reprocess a year", lambda n: figure(n * scale.weighing_core_hours)),
        (f"the same on {cores} cores", lambda n: duration(n * scale.weighing_core_hours / cores)),
        (f"cores for it in {night:g} h", lambda n: figure(max(1.0, n * scale.weighing_core_hours / night))),
        ("A year's cost, mapped frames kept, reprocessed once", lambda n: figure(n * _yearly(scale))),
    ]
    rows = [(name, *(of(float(n)) for n in SIZES)) for name, of in lines]
    return table(" | ".join(["Vehicles", *(f"{n:,}".replace(",", " ") for n in SIZES)]), rows)


def _or_less(cores: float) -> str:
    return figure(cores) if cores >= 0.001 else "under 0.001"


def _yearly(scale: Scale) -> float:
    return (
        scale.uplink_bytes / GB * scale.price("mobile_data_per_gb")
        + scale.stored_cost(scale.parquet_bytes + scale.receipt_bytes + scale.mapped_log_bytes)
        + scale.objects / 1000.0 * scale.price("writes_per_1000")
        + scale.weighing_core_hours * scale.price("core_hour")
    )


def _limits(scale: Scale) -> str:
    rows = ((limit.what, figure(limit.n_vehicles), limit.why, limit.then) for limit in limits_of(scale))
    return table("limit | vehicles | because | remedy", rows)


def _assumed(scale: Scale) -> str:
    rows = [(f"`{section}.{key}`", str(each)) for section, keys in scale.assumed.items() for key, each in keys.items()]
    return table(" | ", rows)


def measured_figures() -> dict[str, Any]:
    """The figures of two commands: for a vehicle, and for a fleet report."""
    return {**numbers("footprint.json"), "report": numbers("fleet_report.json")}


def _of(make: Callable[[Scale], str]) -> Callable[[], str]:
    return lambda: make(Scale(measured_figures(), tomllib.loads((DOCS / "scale.toml").read_text(encoding="utf-8"))))


PARTS: Final[Mapping[str, Callable[[], str]]] = {
    "measured": _of(_measured),
    "vehicle year": _of(_vehicle_year),
    "fleets": _of(_fleets),
    "limits": _of(_limits),
    "assumed": _of(_assumed),
}
