"""Where a report goes."""

from pathlib import Path

from gateway.errors import ConfigurationError


def made_folder(directory: Path) -> None:
    """Make it, unless it is there. Raises ConfigurationError where it cannot be."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        why = f"no report can be written there ({fault.strerror}): name a directory"
        raise ConfigurationError(f"{directory}: {why}") from None
