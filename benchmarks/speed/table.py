"""The figures and their goals as one table, for `make bench` and docs/performance.md."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

LEAST_TIMES: Final = {".mf4": 10}  # as fast as python-can's reader
WHOLE_DAY_H: Final = 8.0  # a working day
MOST_DAY_S: Final = {"cross_spectrum": 10.0}
HELD_BY: Final = {
    "cross_spectrum": (
        "30 to 60 solutions of the model and as many slopes, one after the other, for each begins where another ended; "
        "most of one is hundreds of calls on arrays of a few hundred to a few thousand numbers"
    ),
    "calibration": "1,000 trial costs and 450 curvatures of all runs, one after the other",
    "day": "its batches",
    "import": (
        "FastAPI (a seventh), 216 dataclasses (a sixth) and 108 pydantic models (a seventh) of our own, python-can, "
        "numpy and cantools (a seventh)"
    ),
    "decode": (
        "finding line ends and marks (30 %), our twelfth of the lines (23 %) and their signals (14 %), reading the "
        "file (13 %), comparing identifiers (12 %)"
    ),
    "memory": "what is imported (83 MB before the service starts); weighing takes 12 MB",
    "idle": "three wake-ups a second of 0.2 ms: bus reader 1, event loop 0.9, pipeline 0.5, both senders 0.4",
}
"""What keeps a figure from its goal, as profiles of these benchmarks showed it."""


@dataclass(frozen=True, slots=True)
class Line:
    """One figure. ``goal`` is empty where there is none; ``is_met`` then says nothing. ``held_by`` is what keeps the
    figure from its goal; the table shows it if the goal is missed.
    """

    section: str
    what: str
    figure: str
    goal: str = ""
    is_met: bool = True
    held_by: str = ""

    @property
    def verdict(self) -> str:
        """The goal, whether it is met and, where it is not, what holds the figure."""
        if not self.goal:
            return ""
        missed = f"missed, held by {self.held_by}" if self.held_by else "missed"
        return f"{self.goal}: {'met' if self.is_met else missed}"


def lines_of(found: Mapping[str, Any]) -> list[Line]:
    """Every line that the figures of a run allow; a part that was left out has none."""
    parts = {
        "decode": _decode, "formats": _formats, "day": _day, "live": _live, "service": _service, "idle": _idle,
        "web": _web, "weigh": _weigh, "archive": _archive, "start": _start, "simulator": _simulator,
    }  # fmt: skip
    return [line for name, part in parts.items() if name in found for line in part(found[name])]


def _below(section: str, what: str, figure: float, unit: str, most: float, digits: int = 1, held_by: str = "") -> Line:
    told = f"{figure:,.{digits}f} {unit}"
    return Line(section, what, told, f"at most {most:g} {unit}", figure <= most, held_by)


def _times(ratio: float) -> str:
    return f"{ratio:.2g} x" if ratio < 10 else f"{ratio:,.0f} x"


def _decode(found: Mapping[str, Any]) -> Iterator[Line]:
    section = "candump text to arrays"
    ours = found["rows"]["springscale"]
    for name, row in sorted(found["rows"].items(), key=lambda each: each[1].get("ns_per_frame", float("inf"))):
        if "skipped" in row:
            yield Line(section, name, f"left out: {row['skipped']}")
            continue
        times = row["ns_per_frame"] / ours["ns_per_frame"]
        if row is ours:
            yield _below(section, name, row["ns_per_frame"], "ns a frame", 25, 0, HELD_BY["decode"])
            continue
        yield Line(section, name, f"{row['ns_per_frame']:,.0f} ns a frame, {_times(times)} ours")
    yield _below(section, "memory", ours["peak_mb"], "MB", 150, 0)


def _formats(found: Mapping[str, Any]) -> Iterator[Line]:
    for suffix, row in found["rows"].items():
        if "skipped" in row:
            yield Line("every format", suffix, f"left out: {row['skipped']}")
            continue
        ours, peer = row["springscale"], row["python-can"]
        told = f"{ours['ns_per_frame']:,.0f} ns a frame, {ours['peak_mb']:.0f} MB"
        if "skipped" in peer:
            yield Line("every format", suffix, f"{told}; {peer['skipped']}")
            continue
        times = peer["ns_per_frame"] / ours["ns_per_frame"]
        least = LEAST_TIMES.get(suffix)
        goal = f"at least {least} x" if least else ""
        told = f"{told}, {_times(times)} python-can's reader"
        yield Line("every format", suffix, told, goal, times >= (least or 0))


def _day(found: Mapping[str, Any]) -> Iterator[Line]:
    section = f"a busy day: {found['hours']:g} h, {found['frames'] / 1e6:,.0f} million frames"
    runs = found["estimators"]
    for name, run in runs.items():
        cpu_s, peak_mb, hour_mb = run["day"]["cpu_s"], run["day"]["peak_mb"], run["hour"]["peak_mb"]
        rate = found["frames"] / cpu_s / 1e6
        told = f"{cpu_s:.1f} s, {rate:.1f} million frames/s, {cpu_s / found['wc_s']:.1f} times wc -l"
        most_s = MOST_DAY_S.get(name) if found["hours"] == WHOLE_DAY_H else None
        goal, is_met = f"at most {most_s:g} s" if most_s else "", not most_s or cpu_s <= most_s
        yield Line(section, name, told, goal, is_met, HELD_BY["day"])
        yield Line(
            section,
            f"{name}, memory",
            f"{peak_mb:.0f} MB, of one hour {hour_mb:.0f} MB",
            "flat",
            peak_mb < 1.1 * hour_mb,
        )
    if found["hours"] == WHOLE_DAY_H:
        yield _below(
            section,
            "both estimators",
            sum(run["day"]["cpu_s"] for run in runs.values()),
            "s",
            12,
            held_by=HELD_BY["day"],
        )


def _live(found: Mapping[str, Any]) -> Iterator[Line]:
    section = "receiving and decoding a live bus"
    for bus, run in found.items():
        yield Line(section, bus, f"{run['cpu_pct']:.2f} % of a core")
    fastest = found["8000 frames/s"]
    yield _below(section, "lost at 8000 frames/s", fastest["sent"] - fastest["frames"], "frames", 0, 0)


def _service(found: Mapping[str, Any]) -> Iterator[Line]:
    section = "the whole service, with roll"
    yield _below(section, "a filtered bus of 2500 frames/s", found["cpu_pct"], "% of a core", 3, 2)
    yield _below(section, "memory", found["peak_mb"], "MB", 120, 0, HELD_BY["memory"])
    yield _below(section, "frames lost", found["lost"], "frames", 0, 0)


def _idle(found: Mapping[str, Any]) -> Iterator[Line]:
    section = "a parked vehicle: bus asleep, 1000 batches delivered"
    if "skipped" in found:
        yield Line(section, "the whole service", f"left out: {found['skipped']}")
        return
    most_s = 3.6  # 0.1 % of a core
    yield _below(section, "processor time", found["processor_s_per_hour"], "s an hour", most_s, 1, HELD_BY["idle"])
    yield _below(section, "written to disk", found["disk_kb_per_hour"], "kB an hour", 0, 0)


def _web(found: Mapping[str, Any]) -> Iterator[Line]:
    section = "HTTP: the latest estimate, bus live, eight streams open"
    rate = found["requests_per_s"]
    yield Line(section, "one core of server", f"{rate:,.0f} requests/s", "at least 5000 requests/s", rate >= 5000)
    yield _below(section, "p99", found["p99_ms"], "ms", 20)


def _weigh(found: Mapping[str, Any]) -> Iterator[Line]:
    section = "weighing"
    for name, seconds in found["batch_s"].items():
        what, held_by = f"a batch of 5 minutes of mixed driving, {name}", HELD_BY.get(name, "")
        yield _below(section, what, 1e3 * seconds, "ms", 35, 0, held_by)
    calibration_s = found["calibration"]["cpu_s"]
    yield _below(section, "calibration on ten drives of 15 minutes", calibration_s, "s", 15, 0, HELD_BY["calibration"])
    if "learning" in found:
        fit = found["learning"]
        yield Line(section, "learning in the vehicle, memory", f"{fit['peak_mb']:.0f} MB")
        yield _below(section, "learning in the vehicle from 15 minutes", fit["cpu_s"], "s", 60)


def _archive(found: Mapping[str, Any]) -> Iterator[Line]:
    section = f"a fleet's archive: {found['vehicles']} vehicles of {found['hours']:g} h"
    driven_s, runs = 3600.0 * found["hours"] * found["vehicles"], found["workers"]
    for n, run in runs.items():
        told = f"{run['clock_s']:.1f} s by the clock, {driven_s / run['clock_s']:,.0f} x real time"
        yield Line(section, "one process" if n == "1" else f"{n} processes", told)
    cores = found["cores"]
    if cores > 1:
        times, least = runs["1"]["clock_s"] / runs[str(cores)]["clock_s"], 0.85 * cores
        yield Line(section, f"faster by {cores} cores", f"{times:.2f} x", f"at least {least:g} x", times >= least)


def _start(found: Mapping[str, Any]) -> Iterator[Line]:
    section = "start and install"
    for module, seconds in found["imports_s"].items():
        yield _below(section, f"import {module}", seconds, "s", 0.5, 2, HELD_BY["import"])
    yield _below(section, "READY", found["ready_s"], "s by the clock", 1.5, 2)
    largest = ", ".join(f"{name} {size:.0f}" for name, size in found["largest_mb"].items())
    size, package = found["install_mb"], found.get("package_mb")
    by_pip = f"{size:.0f} MB ({largest})"
    if package is None:
        yield Line(section, "a vehicle's install by pip", by_pip, "at most 250 MB", size <= 250)
    else:
        yield _below(section, "a vehicle's install by its Debian package", package, "MB", 250, 0)
        yield Line(section, "the same by pip, others' tests along", by_pip)


def _simulator(found: Mapping[str, Any]) -> Iterator[Line]:
    for stage, rate in found.items():
        yield Line("simulator", stage, f"{rate:,.0f} x real time")
