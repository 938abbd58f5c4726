"""Parts of scipy that are imported when they are first asked for.

Together they take a third of a service's start and a fifth of its memory, most of it in what they import themselves.
Calibration and the ratio index need them; a service that weighs by cross spectra never does.
"""

from importlib import import_module
from typing import Any, Final


class Late:
    """A module by its name; its functions are its attributes. Raises ImportError when one is first asked for."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, what: str) -> Any:
        return getattr(import_module(self._name), what)


special: Final = Late("scipy.special")
stats: Final = Late("scipy.stats")
