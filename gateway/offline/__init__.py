"""The same pipeline without clock or network: what the service does live, over log files.

Logs and campaign files come in; batches, estimates, calibrations and their errors go out.
"""
