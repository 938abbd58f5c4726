"""The command line: springscale. Commands are imported when they are called, so that --help is quick."""

import gc
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads only cost

import click

from gateway.errors import SpringscaleError
from gateway.model.allocator import keep_freed_memory

_COMMANDS = {
    "calibrate": "Make a calibration file from drives with known loads.",
    "campaign": "Pack known-load drives into one archive, to pass on or to contribute.",
    "check-config": "Check a configuration, without opening the bus.",
    "demo": "Run the whole service on a simulated drive: no hardware, no configuration.",
    "estimate": "Weigh from log files, one line per batch.",
    "evaluate": "Compare estimates with known loads: the error table.",
    "feed": "Send an IMU of Linux IIO and a receiver behind gpsd onto a CAN interface.",
    "fleet-report": "A fleet's data set as pages: each vehicle and what needs attention.",
    "learn": "Learn a vehicle from the logs of ordinary drives and from delivery notes.",
    "look": "The content of an unknown log, and a first signal map from it.",
    "record": "Record the mapped frames of a bus into a log.",
    "replay": "Send a log to a bus, paced by its time stamps.",
    "reprocess": "Reprocess a fleet's archive of logs, on all cores or a cluster.",
    "reproduce": "Repeat the paper's section 4 in the simulator, as a report.",
    "run": "Run the service.",
    "simulate": "Simulate drives, as log files or onto a bus.",
    "state": "Say to a running service what its vehicle carries, import delivery notes, and see what became of them.",
    "token": "Make, list and revoke access tokens for other machines.",
}  # each in the module of its name

INTERRUPTED = 130  # 128 and the number of SIGINT, as shells have it

# What a vehicle does not need, and the extra that has it; in Debian the workbench is a package of its own.
_EXTRAS = {
    "matplotlib": "workbench",
    "numba": "workbench",
    "distributed": "archive",
    "obstore": "archive",
    "polars": "archive",
    "sqlalchemy": "fleet",
}
_DEBIAN_TREE = Path("/usr/lib/springscale")


@contextmanager
def _without_collections() -> Iterator[None]:
    """Pause the search for cyclic garbage: imports make hardly any, and a seventh of a start goes into it."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


class _Lazy(click.Group):
    """A group that imports a command's module only when the command is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command itself, imported now; None if there is none of that name."""
        if cmd_name not in _COMMANDS:
            return None
        name = cmd_name.replace("-", "_")
        with _without_collections():
            command: click.Command = getattr(import_module(f"gateway.cli.{name}"), name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Finds a command as click does; for an unknown name, suggests the one that was probably meant."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as fault:
            if meant := get_close_matches(args[0], _COMMANDS, 1):
                raise click.UsageError(f"{fault.message.rstrip('.')}: did you mean {meant[0]}?", ctx) from None
            raise

    def invoke(self, ctx: click.Context) -> object:
        """Ctrl-C ends quietly, with the exit code of a process that SIGINT ended."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            ctx.exit(INTERRUPTED)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The list of --help, without importing anything."""
        with formatter.section("Commands"):
            formatter.write_dl(sorted(_COMMANDS.items()))


@click.group(cls=_Lazy, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(version("springscale"), "-V", "--version", prog_name="springscale")
def springscale() -> None:
    """Weighs a vehicle by listening to its springs.

    Exit codes: 0 done, 1 the work failed, 2 a wrong option or configuration, 130 interrupted.
    """


def main(arguments: list[str] | None = None) -> None:
    """Entry point. A person's mistake ends in one clear line, never in a traceback.

    Without ``arguments`` they are the process's own, and it ends with the command.
    """
    keep_freed_memory()
    try:
        _call(arguments)
    except SystemExit as leaving:
        if arguments is None and threading.active_count() > 1:
            _leave_threads_behind(leaving)
        raise


def _call(arguments: list[str] | None) -> None:
    try:
        springscale.main(args=arguments, prog_name="springscale")
    except SpringscaleError as fault:
        click.echo(f"springscale: {fault}", err=True)
        sys.exit(fault.exit_code)
    except ModuleNotFoundError as fault:
        extra = _EXTRAS.get((fault.name or "").partition(".")[0])
        if extra is None:
            raise
        click.echo(f"springscale: this command needs {fault.name}: {_install(extra)}", err=True)
        sys.exit(1)
    except OSError as fault:  # a full disk, a file that vanished: whatever no command has told better
        place = fault.filename or "a file or the output"  # writing has no name
        with suppress(OSError):  # standard error may be on that disk
            click.echo(f"springscale: {place}: {fault.strerror or fault}", err=True)
        sys.exit(1)


def _leave_threads_behind(leaving: SystemExit) -> None:
    """End the process although threads that did not stop in time still run.

    Python's normal exit would unwind these threads, and C++ code that must not throw (scipy) would abort the process.
    """
    code = leaving.code if isinstance(leaving.code, int) else int(leaving.code is not None)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # the reader may have gone
            stream.flush()
    os._exit(code)


def _install(extra: str) -> str:
    """The command that installs an extra beside this installation."""
    if extra == "workbench" and Path(__file__).is_relative_to(_DEBIAN_TREE):
        return "apt install springscale-workbench"
    return f"pip install 'springscale[{extra}]'"
