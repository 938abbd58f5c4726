"""What becomes of a file of the service that cannot be believed: renamed out of the way, never written over."""

from pathlib import Path

from gateway.files.kept import KeptFiles


class BrokenFile:
    """Knows whether what cannot be believed still lies at ``path``. Not thread-safe: its owner is."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._is_in_the_way = False

    def set_aside(self) -> str:
        """What became of it, for people."""
        self._is_in_the_way = True
        try:
            return f"is set aside as {self._moved()}"
        except OSError as refusal:
            return f"cannot be set aside: {refusal}"

    def make_way(self) -> None:
        """Before anything is written there. Raises OSError where it still cannot be moved."""
        if self._is_in_the_way:
            self._moved()

    def _moved(self) -> str:
        name = KeptFiles(self._path.parent).set_aside(self._path.name)
        self._is_in_the_way = False
        return name
