"""Sensors without a CAN bus, fed onto one: an inertial unit of Linux IIO and a receiver behind gpsd become frames.

The frames are those of dbc/springscale_reference.dbc, so the pipeline behind the bus is the same.
"""

from gateway.bus.feed.feeder import Feeder, FeedState
from gateway.bus.feed.gpsd import Gpsd
from gateway.bus.feed.iio import AXES, IioDevice, find_devices, turned

__all__ = ["AXES", "FeedState", "Feeder", "Gpsd", "IioDevice", "find_devices", "turned"]
