"""A progress bar on standard error, for people at a terminal; silent elsewhere."""

import sys
from contextlib import AbstractContextManager
from typing import Any

import click


def bar(length: int, label: str) -> AbstractContextManager[Any]:
    """click's bar over ``length`` steps; ``.update(n)`` moves it on by n, ``.pos`` tells where it stands."""
    return click.progressbar(length=length, label=label, file=sys.stderr, hidden=not sys.stderr.isatty())
