"""Options that several commands share."""

from pathlib import Path
from typing import Any

import click

from gateway.config import ESTIMATOR_NAMES, BatchSection
from gateway.core.settings import BatchSettings

FILE = click.Path(path_type=Path)

as_json = click.option("--json", "as_json", is_flag=True, help="machine-readable output")
window = click.option(
    "--window-s", type=click.FloatRange(20.0, 3600.0), default=None, help="length of a batch [default: 300]"
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
