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
    if why_not_learning(settings) is not None:
        return settings
    try:
        active = load_learning(settings.store.directory).active
    except ConfigurationError:
        return settings
    if active is None:
        return settings
    path = settings.store.directory / active.file_name
    return settings.model_copy(update={"calibration": path, "estimator": "cross_spectrum"})


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
