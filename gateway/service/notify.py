"""systemd's readiness protocol (sd_notify(3)): datagrams to NOTIFY_SOCKET, never blocking."""

import contextlib
import os
import socket


class Notifier:
    """Reports the state of the service to systemd. Does nothing if NOTIFY_SOCKET is not set."""

    def __init__(self, environment: os._Environ[str] | dict[str, str] = os.environ) -> None:
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK) if address else None
        self._status = ""

    @property
    def is_heard(self) -> bool:
        """Whether there is a systemd to tell."""
        return self._socket is not None

    def send_status(self, sentence: str) -> None:
        """Set the line that `systemctl status` shows, if it has changed."""
        if sentence != self._status:
            self._status = sentence
            self.send(STATUS=sentence)

    def send(self, **fields: str) -> None:
        """One datagram, e.g. READY="1". A full or vanished socket is never waited for."""
        if self._socket is None:
            return
        text = "\n".join(f"{key}={said}" for key, said in fields.items())
        with contextlib.suppress(OSError):
            self._socket.sendto(text.encode(), self._address)

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
