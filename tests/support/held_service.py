"""``python -m support.held_service run --config FILE``: a service in which the learner never answers."""

import threading
from typing import Any

from gateway.cli import main
from gateway.service.learner.learnt import Learnt


def never(*_: Any) -> str:
    """Waits for ever, as if a stalled disk held a lock."""
    threading.Event().wait()
    return ""


if __name__ == "__main__":
    Learnt.state = never  # type: ignore[method-assign]  # the fault: it never answers
    main()
