"""A vehicle's needs in a year, from measurements and assumptions, and the fleet size at which each limit is reached."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

GB: Final = 1e9  # SI
# SI prefixes
_UNITS: Final = ((1e15, "PB"), (1e12, "TB"), (GB, "GB"), (1e6, "MB"), (1e3, "kB"))


@dataclass(frozen=True, slots=True)
class Scale:
    """The needs of one vehicle in a year of driving, from measurements and assumptions."""

    measured: Mapping[str, Any]
    assumed: Mapping[str, Mapping[str, Any]]

    @property
    def hours(self) -> float:
        driving = self.assumed["driving"]
        return float(driving["hours_per_day"] * driving["days_per_year"])

    @property
    def records(self) -> float:
        return self.hours * 3600.0 / float(self.assumed["driving"]["window_s"])

    @property
    def sqlite_bytes(self) -> float:
        return self.records * float(self.measured["records"]["sqlite_bytes"])

    @property
    def parquet_bytes(self) -> float:
        of = self.measured["records"]["parquet_bytes"]
        return self.records * float(of["per_record"]) + self._jobs * float(of["per_file"])

    @property
    def receipt_bytes(self) -> float:
        """With one log a day."""
        of = self.measured["records"]["receipt_bytes"]
        return float(self.assumed["driving"]["days_per_year"] * of["per_log"]) + self._jobs * float(of["per_file"])

    @property
    def mapped_log_bytes(self) -> float:
        return self.hours * float(self.measured["mapped_frames"]["gz_bytes_per_hour"])

    @property
    def bus_log_bytes(self) -> float:
        return self.hours * float(self.measured["whole_bus"]["gz_bytes_per_hour"])

    @property
    def uplink_bytes(self) -> float:
        uplink = self.measured["uplink"]
        return self.records * float(uplink["wire_bytes_up"] + uplink["wire_bytes_down"])

    @property
    def weighing_core_hours(self) -> float:
        """For logs of the mapped frames only, reading included."""
        weighing = self.measured["weighing"]
        return self.hours * float(weighing["cpu_s"] / weighing["hours"]) / 3600.0

    @property
    def bus_core_hours(self) -> float:
        """For logs of the whole bus: weighing, and reading all other frames."""
        bus = self.measured["whole_bus"]
        mframes = self.hours * 3600.0 * float(bus["frames_per_s"]) / 1e6
        return self.weighing_core_hours + mframes / float(bus["gz_mframes_per_cpu_s"]) / 3600.0

    @property
    def messages_per_s_mean(self) -> float:
        return self.records / (365.0 * 86400.0)

    @property
    def messages_per_s_at_peak(self) -> float:
        driving = self.assumed["driving"]
        return float(driving["share_at_peak"]) / float(driving["window_s"])

    @property
    def report_cpu_s(self) -> float:
        """Per additional vehicle in a fleet report."""
        return self._of_report("cpu_s")

    @property
    def report_memory_bytes(self) -> float:
        return 1e6 * self._of_report("peak_mb")

    @property
    def report_page_bytes(self) -> float:
        return 1e3 * self._of_report("page_kb")

    def _of_report(self, what: str) -> float:
        """The increase per vehicle beyond the first tenth."""
        told = self.measured["report"]
        n_more = int(told["vehicles"]) - max(1, int(told["vehicles"]) // 10)
        return float(told["whole"][what] - told["tenth"][what]) / n_more

    @property
    def objects(self) -> float:
        return 2.0 * self._jobs

    @property
    def _jobs(self) -> float:
        return float(self.assumed["archive"]["jobs_per_vehicle_year"])

    def price(self, name: str) -> float:
        return float(self.assumed["prices"][name])

    def stored_cost(self, n_bytes: float) -> float:
        """The cost of storing this for a year."""
        return n_bytes / GB * 12.0 * self.price("storage_per_gb_month")


@dataclass(frozen=True, slots=True)
class Limit:
    """A limit: the number of vehicles that reach it, the calculation, and the remedy."""

    what: str
    n_vehicles: float
    why: str
    then: str


def limits_of(scale: Scale) -> list[Limit]:
    """All limits, the first to be reached first."""
    machine, archive = scale.assumed["machine"], scale.assumed["archive"]
    broker, people = scale.assumed["broker"], scale.assumed["people"]
    connection, per_message_us = scale.measured["uplink"]["connections"], scale.measured["uplink"]["cpu_us_per_message"]
    listed = archive["objects_listed_per_request"] * archive["requests_per_s"] * archive["most_listing_s"]
    return sorted(
        [
            Limit(
                "One person calibrates",
                people["hours_per_year"] / people["hours_per_calibration"],
                f"{figure(people['hours_per_calibration'])} h a vehicle, {figure(people['hours_per_year'])} h a year",
                "calibrate a line of like vehicles once and commission each vehicle empty; only then more people",
            ),
            Limit(
                "One machine weighs the whole year in a night, logs of the whole bus",
                machine["cores"] * machine["night_hours"] / scale.bus_core_hours,
                f"{figure(scale.bus_core_hours)} core hours a vehicle",
                "record only the mapped frames; add machines by `--scheduler`: jobs share nothing",
            ),
            Limit(
                "One machine weighs the whole year in a night, logs of the mapped frames",
                machine["cores"] * machine["night_hours"] / scale.weighing_core_hours,
                f"{figure(scale.weighing_core_hours)} core hours a vehicle",
                "add machines by `--scheduler`; reprocess only the logs that a change affects: the receipts show them",
            ),
            Limit(
                "The fleet's report on one page",
                1e6 * scale.assumed["report"]["most_page_mb"] / scale.report_page_bytes,
                f"{in_bytes(scale.report_page_bytes)} a vehicle, a browser opens "
                f"{figure(scale.assumed['report']['most_page_mb'])} MB",
                "a report for each depot; use report.json or the data set for more",
            ),
            Limit(
                "The fleet's report in the memory of one machine",
                GB * machine["memory_gb"] / scale.report_memory_bytes,
                f"{in_bytes(scale.report_memory_bytes)} a vehicle of {figure(machine['memory_gb'])} GB",
                "a report for each depot",
            ),
            Limit(
                "The fleet's report in a night, one process",
                3600.0 * machine["night_hours"] / scale.report_cpu_s,
                f"{figure(scale.report_cpu_s)} core seconds a vehicle",
                "a report for each depot, in parallel",
            ),
            Limit(
                "The broker's open files, at a system's usual limit",
                broker["most_handles"],
                f"a connection is a handle, and {figure(broker['most_handles'])} are allowed",
                "raise the limit (LimitNOFILE in the unit file)",
            ),
            Limit(
                "One core of the broker while a whole fleet comes back",
                broker["back_off_max_s"] / (connection["cpu_ms_each"] / 1e3),
                f"{figure(connection['cpu_ms_each'])} ms a TLS connection, all within "
                f"{figure(broker['back_off_max_s'])} s",
                "several brokers by vehicle id; a larger `back_off_max_s`; a TLS proxy before the broker",
            ),
            Limit(
                "Listing one year's receipts before anything begins",
                listed / (scale.objects / 2.0),
                f"{figure(scale.objects / 2.0)} receipts a vehicle, {figure(archive['requests_per_s'])} requests/s of "
                f"{figure(archive['objects_listed_per_request'])}, at most {figure(archive['most_listing_s'])} s",
                "list vehicles in parallel: each has its own prefix; or let the writers keep an index of receipts",
            ),
            Limit(
                "One core of the broker at the busiest moment",
                1e6 / per_message_us / scale.messages_per_s_at_peak,
                f"{figure(per_message_us)} µs a message, received and forwarded",
                "several brokers by vehicle id",
            ),
            Limit(
                "Storing logs of the whole bus costs much",
                scale.price("logs_are_much_at") / scale.stored_cost(scale.bus_log_bytes),
                f"{figure(scale.stored_cost(scale.bus_log_bytes))} a vehicle-year by the example prices, and "
                f"{figure(scale.price('logs_are_much_at'))} a year counts as much",
                "keep only the mapped frames, and the whole bus only around refusals; use cheaper storage",
            ),
            Limit(
                "Storing logs of the mapped frames costs much",
                scale.price("logs_are_much_at") / scale.stored_cost(scale.mapped_log_bytes),
                f"{figure(scale.stored_cost(scale.mapped_log_bytes))} a vehicle-year, as above",
                "keep logs while the method may still change, records for ever; use cheaper storage",
            ),
        ],
        key=lambda limit: limit.n_vehicles,
    )


def figure(number: float) -> str:
    """Two significant digits, the whole number from a hundred on; thousands separated."""
    if number == 0.0:
        return "0"
    if number < 100.0:
        return f"{float(f'{number:.2g}'):.10f}".rstrip("0").rstrip(".")
    return f"{float(f'{number:.3g}'):,.0f}".replace(",", " ")


def in_bytes(number: float) -> str:
    for unit, name in _UNITS:
        if number >= unit:
            return f"{figure(number / unit)} {name}"
    return f"{figure(number)} B"


def duration(hours: float) -> str:
    if hours < 1.0:
        return f"{figure(60.0 * hours)} min"
    return f"{figure(hours)} h" if hours < 100.0 else f"{figure(hours / 24.0)} days"
