"""The material of estimation: batches, gates, loads, the ratio index, weights on the road. No clock, no files, no bus.

This package imports nothing itself, so that the command line starts without the modules that only estimation needs.
"""
