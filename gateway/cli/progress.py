"""Progress on standard error, for people at a terminal; silent elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from types import TracebackType
from typing import Final, Protocol

import click

SHOWN_EVERY_S: Final = 0.2  # chosen: as fast as a person reads


class StatusLine(AbstractContextManager["StatusLine"]):
    """One line that shows the progress of work of unknown length; removed at the end."""

    def __init__(self) -> None:
        self._is_shown = sys.stderr.isatty()
        self._next_s = 0.0

    def show(self, text: str) -> None:
        """Write the text over the one before, a few times a second at most."""
        if self._is_shown and time.monotonic() >= self._next_s:
            self._next_s = time.monotonic() + SHOWN_EVERY_S
            click.echo(f"\r\x1b[K{text}", err=True, nl=False)

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._is_shown:
            click.echo("\r\x1b[K", err=True, nl=False)


class Steps(Protocol):
    """Moves a bar: steps done, steps in all, and the name of the next step if it has one."""

    def __call__(self, done: int, of: int, label: str | None = None) -> None: ...


@contextmanager
def counted(label: str) -> Iterator[Steps]:
    """click's bar for work of known length."""
    with click.progressbar(length=1, label=label, file=sys.stderr, hidden=not sys.stderr.isatty()) as progress:

        def on_step(done: int, of: int, label: str | None = None) -> None:
            progress.length = of
            progress.label = label or progress.label
            progress.update(done - progress.pos)

        yield on_step


def on_share(on_step: Steps, parts: Sequence[str]) -> Callable[[str, int, int], None]:
    """One bar for ``parts`` that each report (name, steps done, steps in all): every part gets the same length."""

    def on_part(name: str, done: int, of: int) -> None:
        percent = 100 * parts.index(name) + 100 * done // of
        on_step(percent, 100 * len(parts), f"fitting {name.replace('_', ' ')}")

    return on_part
