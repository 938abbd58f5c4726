"""Observations of the pipeline's frames for the status: the health of signals, and whether the vehicle stands."""

from gateway.service.watching.signals import SignalWatch
from gateway.service.watching.standing import StandingWatch

__all__ = ["SignalWatch", "StandingWatch"]
