"""Files with odd things in odd places, and limits within which whatever reads them must end."""

import re
import resource
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Final

from hypothesis import strategies as st

SECONDS: Final = 10.0
MEGABYTES: Final = 300
ODD: Final = (
    *(b"", b"\0", b"\n", b"\r", b'"', b"'", b"#", b";", b",", b" ", b"//", b"\\", b"[", b"{", b"=", b"-", b"|"),
    *b"0 -1 1e999 nan inf 1.5 0x10 4294967296 65536 FFFFFFFF".split(),
    *(b"9" * 25, b"9" * 5000),
    *(b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3\x28", "ä".encode(), "\u202e".encode(), b"\xed\xa0\x80", b"A" * 3000),
)  # fmt: skip

Change = tuple[int, bool, int, bytes]


def changes(more: Sequence[bytes] = ()) -> st.SearchStrategy[list[Change]]:
    """A few places (whole words, or some bytes), and what stands there instead; ``more`` are words of the kind."""
    new = st.one_of(st.sampled_from((*ODD, *more)), st.binary(max_size=8))
    place = st.tuples(st.integers(0, 1 << 20), st.booleans(), st.integers(0, 40), new)
    return st.lists(place, min_size=1, max_size=5)


def changed(content: bytes, where: Sequence[Change]) -> bytes:
    """The content with these changes, one after the other."""
    for place, is_word, n_bytes, new in where:
        words = list(re.finditer(rb"[\w.+-]+", content)) if is_word else []
        if words:
            word = words[place % len(words)]
            content = content[: word.start()] + new + content[word.end() :]
        else:
            at = place % (len(content) + 1)
            content = content[:at] + new + content[at + n_bytes :]
    return content


class TookTooLongError(BaseException):
    """No handler of exceptions takes it for a fault of the file."""


def refusal_of(kind: type[Exception], use: Callable[[], object]) -> str | None:
    """The message with which ``use`` refuses within the limits; None if it does not. Other exceptions pass through."""
    with limits():
        try:
            use()
        except kind as fault:
            return str(fault)
    return None


@contextmanager
def limits() -> Iterator[None]:
    """Within a block: seconds on the clock, and megabytes more than now, behind which allocating fails."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise TookTooLongError(f"more than {SECONDS:g} s")

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    before = resource.getrlimit(resource.RLIMIT_AS)
    handler = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, SECONDS)
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEGABYTES * 1_000_000, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, handler)
