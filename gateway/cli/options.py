"""Options and arguments that several commands share."""

import functools
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import click

from gateway.bus.frames import Speed
from gateway.config import ESTIMATOR_NAMES, BatchSection
from gateway.core.batch_settings import BatchSettings
from gateway.records import json_line
from gateway.units import zone_of

FILE = click.Path(path_type=Path)


class NumberRange(click.FloatRange):
    """A finite number within a range: click accepts nan, whatever the range, and inf."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Raises a usage error for a typed text that is not a finite number."""
        number: float = super().convert(value, param, ctx)
        if isinstance(value, str) and not math.isfinite(number):
            self.fail(f"{value!r} is no number", param, ctx)
        return number


as_json = click.option("--json", "as_json", is_flag=True, help="machine-readable output")

Told = tuple[Mapping[str, Any], str]  # the same for programs and in words


def prints(command: Callable[..., Told]) -> Callable[..., None]:
    """Print what the command returns: in words, or with --json the object on one line."""

    @functools.wraps(command)
    def printing(*, as_json: bool, **options: Any) -> None:
        record, text = command(**options)
        click.echo(json_line(record) if as_json else text)

    return as_json(printing)


window = click.option(
    "--window-s", type=NumberRange(20.0, 3600.0), default=None, help="length of a batch [default: 300]"
)
config = click.option("--config", "config_path", type=FILE, default=None, help="springscale.toml of the service")
signals = click.option("--signals", default=None, help="signal map: a TOML file, or springscale:NAME")
calibration = click.option("--calibration", type=FILE, default=None, help="calibration file")
one_estimator = click.option("--estimator", type=click.Choice(ESTIMATOR_NAMES), default=None, help="which estimator")


Value = TypeVar("Value")


class Parsed(click.ParamType[Value]):
    """What ``parse`` makes of a word; what its ValueError says becomes the usage error."""

    def __init__(self, name: str, parse: Callable[[str], Value]) -> None:
        self.name = name
        self._parse = parse

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Value:
        """Raises a usage error for a word that means nothing."""
        try:
            parsed: Value = self._parse(value) if isinstance(value, str) else value
        except ValueError as fault:
            self.fail(str(fault), param, ctx)
        return parsed


def run_numbers(text: str) -> tuple[int, ...]:
    """1,5,10 -> (1, 5, 10)."""
    try:
        return tuple(int(number) for number in text.split(","))
    except ValueError:
        raise ValueError(f"{text!r} is not a list of run numbers such as 1,5,10") from None


def speed_factor(text: str) -> Speed:
    """2.5 -> 2.5; max -> "max"."""
    if text == "max":
        return "max"
    with suppress(ValueError):
        if 0.0 < (factor := float(text)) < math.inf:
            return factor
    raise ValueError(f"{text!r} is neither a number above 0 nor max")


def moment(text: str) -> datetime:
    """2026-11-26T07:40:00Z; without a zone the time of this computer."""
    try:
        return datetime.fromisoformat(text).astimezone(UTC)
    except ValueError:
        raise ValueError(f"{text!r} is no time; write it as 2026-11-26T07:40") from None


MOMENT = Parsed("time", moment)
ZONE = Parsed("zone", zone_of)


def batch_settings(window_s: float | None) -> BatchSettings:
    """The default settings of a batch, with another window length where one is given."""
    return BatchSection().for_core(window_s=window_s)


interface = click.option(
    "--interface",
    required=True,
    help="python-can's name, such as socketcan, slcan or pcan",
)
channel = click.option("--channel", required=True, help="of that interface: can0, vcan0, ...")


speed = click.option(
    "--speed",
    type=Parsed("speed", speed_factor),
    metavar="NUMBER|max",
    default=1.0,
    show_default=True,
    help="2 is twice as fast as the time stamps, max as fast as the bus takes it",
)
