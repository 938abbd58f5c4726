"""How the benchmarks measure: CPU time of one core, the best of some runs, each path in a process of its own.

CPU time, not the clock: the machine's other work disturbs a ratio least in it. Logs lie in the page cache. A process
that is measured is started by a small one (``python -m benchmarks.speed.meter``), because Linux counts the peak memory
of a parent as its child's.
"""

import argparse
import importlib
import json
import os
import platform
import resource
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
CALIBRATION = ROOT / "gateway/demo/paper_van.json"
ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",
    "POLARS_MAX_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "PYTHONDONTWRITEBYTECODE": "",  # modules are compiled once, as an installation has them
}
"""Of every process that is measured."""


def cpu_s() -> float:
    """CPU time of this process and of its finished children."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + used.ru_utime + used.ru_stime


def best_of(n_times: int, work: Callable[[], dict[str, Any]]) -> dict[str, Any]:
    """The result of the work, with ``seconds``, the CPU time of the fastest run, and the peak memory of the process.

    If the result counts ``frames``, also the nanoseconds for each.
    """
    quickest: dict[str, Any] = {}
    for _ in range(n_times):
        begun_s = cpu_s()
        found = work()
        found["seconds"] = cpu_s() - begun_s
        if not quickest or found["seconds"] < quickest["seconds"]:
            quickest = found
    if "frames" in quickest:
        quickest["ns_per_frame"] = 1e9 * quickest["seconds"] / quickest["frames"]
    return quickest | {"peak_mb": peak_mb()}


def peak_mb(pid: int | str = "self") -> float:
    """Peak memory of a process so far; unlike rusage's it excludes its parent's."""
    status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    return int(status["VmHWM"].split()[0]) / 1024


def cpu_of_s(pid: int) -> float:
    """CPU time that another process has taken so far (proc(5))."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def free_port() -> int:
    """A port of the loopback interface that nobody listens on."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


def machine() -> str:
    """The kind of processor, and the version of Python."""
    return f"{platform.machine()}, Python {platform.python_version()}"


def command_of(function: Callable[..., object] | str, *arguments: object) -> list[str]:
    """The command that calls a function of a module (or "module:function") in a process of its own.

    Its arguments are numbers, texts and lists of them; a path arrives as text. What it returns is printed as JSON.
    """
    name = function if isinstance(function, str) else f"{function.__module__}:{function.__name__}"
    return [sys.executable, "-m", "benchmarks.speed.meter", name, json.dumps(arguments, default=str)]


def in_own_process(function: Callable[..., object] | str, *arguments: object) -> dict[str, Any]:
    """The result of a function, called in a process of its own with this environment."""
    command = command_of(function, *arguments)
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, env=os.environ | ENVIRONMENT)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def print_answer(call: Callable[[], object]) -> None:
    """Print the result of ``call`` as JSON, or the reason why there is none; nothing for None."""
    try:
        found = call()
    except ModuleNotFoundError as fault:
        found = {"skipped": f"{fault.name} is not installed"}
    if found is not None:
        print(json.dumps(found))


def springscale(*arguments: object) -> dict[str, Any]:
    """One run of the command: ``clock_s``, ``cpu_s``, ``peak_mb`` and its ``output``. Raises CalledProcessError."""
    return in_own_process("benchmarks.speed.meter:run_command", ["-m", "gateway", *map(str, arguments)])


def run_command(arguments: list[str]) -> dict[str, Any]:
    """The same figures, from the small process that starts the command."""
    begun_s = time.perf_counter()
    process = subprocess.Popen([sys.executable, *arguments], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    output = process.stdout.read()
    process.stdout.close()
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"{' '.join(arguments)} ended with {process.returncode}")
    return {
        "clock_s": time.perf_counter() - begun_s,
        "cpu_s": used.ru_utime + used.ru_stime,
        "peak_mb": used.ru_maxrss / 1024,
        "output": output,
    }


def print_and_write(doc: str | None, measure: Callable[..., Any], **amounts: float) -> Any:
    """The command line of a program: ``measure`` with these amounts, each an option; prints, writes to ``--output``."""
    parser = argparse.ArgumentParser(description=(doc or "").splitlines()[0])
    for name, amount in amounts.items():
        parser.add_argument(f"--{name}", type=type(amount), default=amount, help="[default: %(default)s]")
    parser.add_argument("--output", type=Path, help="JSON file for the figures")
    asked = vars(parser.parse_args())
    output: Path | None = asked.pop("output")
    figures = measure(**asked)
    text = json.dumps(figures, indent=1) + "\n"
    if output is not None:
        output.parent.mkdir(parents=True, exist_ok=True)
        output.write_text(text, encoding="utf-8")
    print(text, end="")
    return figures


def main(name: str, arguments: str) -> None:
    """Call what ``command_of`` names."""
    module, _, function = name.partition(":")
    print_answer(lambda: getattr(importlib.import_module(module), function)(*json.loads(arguments)))


if __name__ == "__main__":
    main(*sys.argv[1:])
