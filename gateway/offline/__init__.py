"""The service's pipeline over log files, without clock or network.

Logs and campaign files go in; batches, estimates, calibrations and their errors come out.
"""

from gateway.offline.campaigns import calibrate, inspect, judge_campaign, split_runs
from gateway.offline.estimates import estimates_of_logs

__all__ = ["calibrate", "estimates_of_logs", "inspect", "judge_campaign", "split_runs"]
