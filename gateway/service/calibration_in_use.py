"""The calibration that a service uses: the one learnt here, else the configured file."""

from gateway.config import Settings
from gateway.errors import ConfigurationError
from gateway.service.learner.learning_file import load_learning
from gateway.setup import Setup, setup_of


def why_not_learning(settings: Settings) -> str | None:
    """Why the vehicle may not be learnt here; None if it may."""
    if not settings.learning.is_allowed:
        return "[learning] is_allowed = false: calibrations come by file"
    return None


def with_learnt(settings: Settings) -> Settings:
    """The settings with the calibration that was learnt here and is in use; unchanged if there is none.

    An invalid record is ignored here: the service sets it aside and reports it.
    """
    name = _learnt(settings)
    if name is None:
        return settings
    path = settings.store.directory / name
    return settings.model_copy(update={"calibration": path, "estimator": "cross_spectrum"})


def _learnt(settings: Settings) -> str | None:
    if why_not_learning(settings) is not None:
        return None
    try:
        active = load_learning(settings.store.directory).active
    except ConfigurationError:
        return None
    return None if active is None else active.file_name


def learnt(settings: Settings) -> tuple[Settings, Setup, str | None]:
    """The settings in use, the setup, and why the calibration learnt here is not in use, None if it is.

    Raises as ``setup_of``.
    """
    chosen = with_learnt(settings)
    if chosen is settings:
        return settings, setup_of(settings), None
    try:
        return chosen, setup_of(chosen), None
    except ConfigurationError as broken:
        fault = f"the calibration that was learnt cannot be used ({broken}): choose another version, or `file`"
        return settings, setup_of(settings), fault
