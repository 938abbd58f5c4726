"""The simulator at work: campaigns to drive, their frames as the sensors of a signal map send them, a live stream.

A kind of campaign and a van come in; candump logs with their campaign file, or frames on a bus, go out. It knows the
simulator and the bus, and nothing of what is weighed from them.
"""
