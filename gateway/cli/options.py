"""Options that several commands share."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click

from gateway.bus.live import usable_interfaces
from gateway.bus.sink import Speed
from gateway.config import ESTIMATOR_NAMES, BatchSection
from gateway.core.settings import BatchSettings

FILE = click.Path(path_type=Path)


class Number(click.types.FloatParamType):
    """A finite number: click accepts nan, whatever the range, and inf."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Raises a usage error for a typed text that is not a finite number."""
        number: float = super().convert(value, param, ctx)
        if isinstance(value, str) and not math.isfinite(number):
            self.fail(f"{value!r} is no number", param, ctx)
        return number


class NumberRange(Number, click.FloatRange):
    """One within a range."""


NUMBER = Number()


class CampaignFile(click.Path):
    """A campaign file; an archive of `campaign pack` is unpacked for as long as the command runs."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Raises CampaignError for an archive that is not whole."""
        path = Path(str(super().convert(value, param, ctx)))
        if path.suffix.lower() != ".zip" or ctx is None:
            return path
        from gateway.offline.bundle import unpacked  # noqa: PLC0415 # --help need not wait for it

        return unpacked(path, Path(ctx.with_resource(TemporaryDirectory(prefix="springscale-"))))


CAMPAIGN = CampaignFile()

as_json = click.option("--json", "as_json", is_flag=True, help="machine-readable output")
trusted_keys = click.option(
    "--trusted-keys",
    type=FILE,
    default=None,
    help="file of public keys, one of which must have signed the configuration [default: signatures are not required]",
)
window = click.option(
    "--window-s", type=NumberRange(20.0, 3600.0), default=None, help="length of a batch [default: 300]"
)
one_estimator = click.option("--estimator", type=click.Choice(ESTIMATOR_NAMES), default=None, help="which estimator")


class RunNumbers(click.ParamType[tuple[int, ...]]):
    """1,5,10 -> (1, 5, 10)."""

    name = "numbers"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...]:
        """Raises a usage error for anything but whole numbers with commas."""
        if isinstance(value, tuple):
            return value
        try:
            return tuple(int(number) for number in str(value).split(","))
        except ValueError:
            self.fail(f"{value!r} is not a list of run numbers such as 1,5,10", param, ctx)


def batch_settings(window_s: float | None) -> BatchSettings:
    """The default settings of a batch, with another window length where one is given."""
    return BatchSection().for_core(window_s=window_s)


interface = click.option(
    "--interface",
    required=True,
    help=f"python-can's name; on this computer {', '.join(usable_interfaces())} (an adapter's wants its driver)",
)
channel = click.option("--channel", required=True, help="of that interface: can0, vcan0, ...")


class SpeedFactor(click.ParamType[Speed]):
    """2.5 -> 2.5; max -> "max"."""

    name = "speed"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str:
        """As the help shows it."""
        return "NUMBER|max"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Speed:
        """Raises a usage error for anything but a positive number or max."""
        if value == "max":
            return "max"
        try:
            factor = float(value)
        except ValueError:
            factor = math.nan
        if not 0.0 < factor < math.inf:
            self.fail(f"{value!r} is neither a number above 0 nor max", param, ctx)
        return factor


speed = click.option(
    "--speed",
    type=SpeedFactor(),
    default=1.0,
    show_default=True,
    help="2 is twice as fast as the time stamps, max as fast as the bus takes it",
)
