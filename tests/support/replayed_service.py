"""``python -m support.replayed_service CONFIG LOG [later]``: the service and a drive on its bus, in one process."""

import sys
import threading
from pathlib import Path

import pytest

from gateway.bus.sink import replay
from gateway.config import load_settings
from gateway.log import set_up_log
from gateway.service.gateway import Gateway
from gateway.setup import setup_of
from support.unhurried import unhurry


def main(config: Path, log: Path, *, is_later: bool) -> None:
    """Plays the log at full speed, or after a line on standard input; another line ends the service."""
    settings = load_settings(config)
    set_up_log(settings.log.level, under_journald=True)

    def on_started(gateway: Gateway) -> None:
        threading.Thread(target=play, args=(gateway,), daemon=True).start()

    def play(gateway: Gateway) -> None:
        try:
            if is_later:
                sys.stdin.readline()
            replay(log, settings.bus.interface, settings.bus.channel, speed="max")
            sys.stdin.readline()  # whoever started us has seen enough
        finally:
            gateway.request_stop()

    Gateway(settings, setup_of(settings), on_started=on_started).run()


if __name__ == "__main__":
    unhurry(pytest.MonkeyPatch())
    main(Path(sys.argv[1]), Path(sys.argv[2]), is_later="later" in sys.argv[3:])
