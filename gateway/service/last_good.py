"""The last good copy of the calibration file, used if the file cannot be read at a later start.

The copies are in the service's own directory, one for each configured path, so a copy is never used for another path.
"""

import hashlib
import logging
from pathlib import Path

from gateway.calibration.file.calibration_file import CalibrationFile
from gateway.config import Settings
from gateway.errors import CalibrationFileError, UntrustedFileError
from gateway.files.kept import KeptFiles
from gateway.files.signed import SUFFIX, signature_path
from gateway.log import Event, log_event
from gateway.setup import Setup, setup_of


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
