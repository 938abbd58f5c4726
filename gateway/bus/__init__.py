"""CAN in, motion out: frames from a bus or a log, decoded by the signal map into SI samples in the vehicle's axes.

``listen`` receives from interfaces, ``logs`` reads and writes recordings, ``signals`` turns payloads into samples;
``frames`` are columns, ``sink`` sends them to a bus again. Only this room imports python-can and cantools.
"""

import logging
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextmanager
def _without(module: str) -> "Iterator[None]":
    """Block the import of ``module`` within the context, unless it is already imported."""
    modules = cast(dict[str, Any], sys.modules)
    is_absent = modules.setdefault(module, None) is None
    yield
    if is_absent:
        del modules[module]


# python-can imports asammdf and pandas if they are installed, which costs seconds at every start, for a reader of .mf4
# that is not used here (logs.mf4 is).
with _without("asammdf"):
    import can  # noqa: F401 # before any other module imports it

logging.getLogger("can").setLevel(logging.CRITICAL)  # its faults come as exceptions too, which we tell once
