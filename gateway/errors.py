"""The errors shown to people. Each message says what is wrong, where, and how to mend it."""

from typing import Final


class SpringscaleError(Exception):
    """The work failed; the command line prints only the message and exits with 1."""

    exit_code = 1


class ConfigurationError(SpringscaleError):
    """A file or an option that a person wrote cannot be used; exits with 2."""

    exit_code = 2


class NothingWeighedError(SpringscaleError):
    """Logs were read, and no batch in them gave an estimate."""


class SignalMapError(ConfigurationError):
    """A signal map and its DBC files do not fit together."""


class CampaignError(ConfigurationError):
    """A campaign file cannot be used as it stands."""


class CalibrationFileError(ConfigurationError):
    """A calibration file is missing, damaged, of another version or of another vehicle."""


class NoSisterError(ConfigurationError):
    """A calibration cannot serve as a sister's, or the vehicle is of another model."""


NOT_STORED: Final = "not_stored"
"""Reason of a refusal because the disk fails: later it may succeed."""


class RefusedError(SpringscaleError):
    """The service cannot do now what somebody asks for: a statement, another version of the calibration.

    ``reason`` is for programs; the message says why, and what to do.
    """

    def __init__(self, reason: str, message: str) -> None:
        super().__init__(message)
        self.reason = reason


class CalibrationImpossibleError(SpringscaleError):
    """The known-load drives are not sufficient for a calibration."""


class KeptBatchError(SpringscaleError):
    """A kept batch is damaged, or was written by another program."""


class LogUnreadableError(SpringscaleError):
    """A log holds no frame that can be read."""


class ReaderMissingError(LogUnreadableError):
    """The reader for this kind of log is not installed."""


class ArraysError(SpringscaleError):
    """Arrays of measurements fit neither together nor the calibration."""


class BusError(SpringscaleError):
    """A CAN interface cannot be opened at all (wrong name, missing driver)."""


class StoreError(SpringscaleError):
    """The database cannot be used now, for example because another Springscale uses it."""


class StoreRefusedError(StoreError):
    """The database is of another version or program, so retrying does not help; exits with 2."""

    exit_code = 2
