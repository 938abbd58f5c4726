"""Simulated campaigns as candump logs, or as frames sent live to a bus by the sensors of a signal map.

Input: a kind of campaign and a van. Output: candump logs with their campaign file, or frames on a bus. This package
uses the simulator and the bus; it does not depend on the estimators.
"""

from gateway.workbench.demo_drive import demo_drive, frames_of
from gateway.workbench.simulate import Bench, bench_of, stream, write_campaign

__all__ = ["Bench", "bench_of", "demo_drive", "frames_of", "stream", "write_campaign"]
