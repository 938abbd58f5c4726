"""Numbers with their nouns, for people."""


def counted(n: int, noun: str) -> str:
    """ "1 run", "2 runs"."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"


def one_or_more(n: int, one: str, more: str) -> str:
    """ "one batch", "2 batches"."""
    return f"one {one}" if n == 1 else f"{n} {more}"
