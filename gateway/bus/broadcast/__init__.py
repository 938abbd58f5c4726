"""Weights onto another CAN bus, if the settings ask for it: J1939 frames at a steady pace.

The present weights come in; frames go out on an interface of their own. The interface that is listened to is opened
elsewhere (``bus.live``) and never sent on.
"""

from gateway.bus.broadcast.broadcaster import Broadcaster
from gateway.bus.broadcast.weight_frames import Sender, WeightFrames

__all__ = ["Broadcaster", "Sender", "WeightFrames"]
