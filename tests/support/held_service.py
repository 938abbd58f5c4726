"""``python -m support.held_service run --config FILE``: a service in which the commissioning never answers."""

import threading
from typing import Any

from gateway.cli import main
from gateway.service.commissioning.session import Commissioning


def never(*_: Any) -> str:
    """As behind a lock that a stalled disk holds."""
    threading.Event().wait()
    return ""


if __name__ == "__main__":
    Commissioning.state = never  # type: ignore[method-assign]  # a fault, put in
    main()
