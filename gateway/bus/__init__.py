"""CAN in, motion out: frames from a bus or a log, decoded by the signal map into SI samples in the vehicle's axes.

``live`` receives from interfaces, ``logs`` reads and writes recordings, ``signals`` turns payloads into samples;
``frames`` are columns, ``sink`` sends them to a bus again. python-can and cantools are known here alone.
"""
