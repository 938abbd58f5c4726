"""The calibration that a service starts with: the one made on the vehicle, if there is one."""

import logging

from gateway.config import Settings
from gateway.errors import ConfigurationError
from gateway.log import Event, log_event
from gateway.service.commissioning.record import load_record
from gateway.service.last_good import setup_or_last_good
from gateway.setup import Setup, setup_of


def why_not_allowed(settings: Settings) -> str | None:
    """Why no calibration may be made on this vehicle; None if one may."""
    if not settings.commissioning.is_allowed:
        return "[commissioning] is_allowed = false: calibrations come by file"
    if settings.trust.public_keys and not settings.commissioning.is_unsigned_believed:
        return (
            "[trust] requires signed calibrations, and nobody signs those made on the vehicle: set [commissioning] "
            "is_unsigned_believed to use them all the same"
        )
    return None


def with_commissioned(settings: Settings) -> Settings:
    """The settings with the calibration that was made here and is in use; unchanged if there is none.

    An invalid record is ignored here: the service sets it aside and reports it.
    """
    if why_not_allowed(settings) is not None:
        return settings
    try:
        active = load_record(settings.store.directory).active
    except ConfigurationError:
        return settings
    if active is None:
        return settings
    path = settings.store.directory / active.file_name
    return settings.model_copy(update={"calibration": path, "estimator": "cross_spectrum"})


def commissioned(settings: Settings) -> tuple[Settings, Setup, str | None]:
    """The settings in use, the setup, and the fault of the calibration if another replaces it.

    Raises as ``setup_of``.
    """
    chosen = with_commissioned(settings)
    if chosen is settings:
        return settings, *setup_or_last_good(settings)
    try:
        return chosen, _with_made(chosen), None
    except ConfigurationError as broken:
        log_event(Event.SETUP_REFUSED, level=logging.ERROR, fault=str(broken))
        setup, fault = setup_or_last_good(settings)
        what = f"the calibration made on the vehicle cannot be used ({broken}): make another, or undo it"
        return settings, setup, f"{what}; {fault}" if fault else what


def setup_in_use(settings: Settings) -> Setup:
    """The setup with the calibration in use; one that was made here is accepted unsigned. Raises as ``setup_of``."""
    chosen = with_commissioned(settings)
    return setup_of(settings) if chosen is settings else _with_made(chosen)


def _with_made(chosen: Settings) -> Setup:
    """All files are read with the settings' trust, except the calibration that was made here and that nobody signs."""
    own, read = chosen.calibration, chosen.trust.for_reading().read
    return setup_of(chosen, read=lambda path: path.read_bytes() if path == own else read(path))
