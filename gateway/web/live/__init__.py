"""The current state: the board that shows the latest estimate, and the streams that send each new one.

Estimates come from the pipeline's thread; the latest with its age goes out, thousands of times a second if need be, and
each new one as an event to every stream, after the events that a client missed.
"""
