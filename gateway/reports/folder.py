"""The output directory of a report."""

from pathlib import Path

from gateway.errors import ConfigurationError


def made_folder(directory: Path) -> None:
    """Create the directory if needed and return it. Raises ConfigurationError if that fails."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        why = f"no report can be written there ({fault.strerror}): name a directory"
        raise ConfigurationError(f"{directory}: {why}") from None
