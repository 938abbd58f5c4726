"""The simulator at work: campaigns to drive, their frames as the sensors of a signal map send them, a live stream.

A kind of campaign and a van come in; candump logs with their campaign file, or frames on a bus, go out. It knows the
simulator and the bus, and nothing of what is weighed from them.
"""

from gateway.workbench.demo_drive import demo_drive, frames_of
from gateway.workbench.simulate import Bench, bench_of, stream, write_campaign

__all__ = ["Bench", "bench_of", "demo_drive", "frames_of", "stream", "write_campaign"]
