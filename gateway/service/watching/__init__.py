"""What the pipeline sees go by, kept for those who ask how the vehicle is: signals, and whether it stands."""

from gateway.service.watching.signals import SignalWatch
from gateway.service.watching.standing import StandingWatch

__all__ = ["SignalWatch", "StandingWatch"]
