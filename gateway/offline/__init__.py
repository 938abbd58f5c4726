"""The service's pipeline over log files, without clock or network.

Logs and campaign files go in; batches, estimates, calibrations and their errors come out.
"""
