"""The calibration that a service uses: the one made on the vehicle, else the configured file, else its last good copy.

The copies are in the service's own directory, one for each configured path, so a copy is never used for another path.
"""

import hashlib
import logging
from pathlib import Path

from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.config import Settings
from gateway.errors import CalibrationFileError, ConfigurationError, UntrustedFileError
from gateway.files.kept import KeptFiles
from gateway.files.signed import SUFFIX, signature_path
from gateway.log import Event, log_event
from gateway.service.commissioning.record import FILE_NAME, CommissioningRecord
from gateway.service.record_file import load_record
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
        active = load_record(settings.store.directory / FILE_NAME, CommissioningRecord()).active
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
    chosen, faults = with_commissioned(settings), []
    if chosen is not settings:
        try:
            return chosen, _with_made(chosen), None
        except ConfigurationError as broken:
            log_event(Event.SETUP_REFUSED, level=logging.ERROR, fault=str(broken))
            faults.append(f"the calibration made on the vehicle cannot be used ({broken}): make another, or undo it")
    setup, fault = setup_or_last_good(settings)
    return settings, setup, "; ".join([*faults, *([fault] if fault else [])]) or None


def setup_in_use(settings: Settings) -> Setup:
    """The setup with the calibration in use; one that was made here is accepted unsigned. Raises as ``setup_of``."""
    chosen = with_commissioned(settings)
    return setup_of(settings) if chosen is settings else _with_made(chosen)


def _with_made(chosen: Settings) -> Setup:
    """All files are read with the settings' trust, except the calibration that was made here and that nobody signs."""
    own, read = chosen.calibration, chosen.trust.for_reading().read
    return setup_of(chosen, read=lambda path: path.read_bytes() if path == own else read(path))


def setup_or_last_good(settings: Settings) -> tuple[Setup, str | None]:
    """The setup, and the fault of the calibration file if its last good copy replaces it, else None.

    Raises as ``setup_of``; for a broken calibration file only if there is no good copy.
    """
    try:
        return setup_of(settings), None
    except CalibrationFileError as broken:
        if settings.calibration is None:
            raise
        fault, copy = broken, settings.store.directory / _name_of(settings.calibration)
    try:
        setup = setup_of(settings.model_copy(update={"calibration": copy}))
    except CalibrationFileError:
        raise fault from None
    return setup, f"{fault}; weighing goes on with the last good copy of it: restore the file, then restart"


def keep_copy(settings: Settings, calibration: CalibrationFile) -> None:
    """Store a copy for later starts; a disk fault is logged and does not stop the weighing."""
    if settings.calibration is None or settings.calibration.parent == settings.store.directory:  # it lies there already
        return
    files, name, path = KeptFiles(settings.store.directory), _name_of(settings.calibration), settings.calibration
    try:
        if settings.trust.public_keys:  # the copy needs the signature, and therefore the identical bytes
            kept = {name: settings.trust.for_reading().read(path), name + SUFFIX: signature_path(path).read_bytes()}
        else:
            kept = {name: calibration.to_json().encode()}
        for one, content in kept.items():
            if files.stamp(one) is None or files.read(one) != content:
                files.write(one, content)
    except (OSError, UntrustedFileError) as fault:
        log_event(Event.CALIBRATION_NOT_KEPT, level=logging.WARNING, fault=str(fault))


def _name_of(path: Path) -> str:
    return f"calibration-{hashlib.sha256(str(path).encode('utf-8', 'surrogateescape')).hexdigest()[:16]}.json"
