"""The same pipeline without clock or network: what the service does live, over log files.

Logs and campaign files come in; batches, estimates, calibrations and their errors go out.
"""

from gateway.offline.campaigns import calibrate, inspect, judge_campaign, split_runs
from gateway.offline.estimates import estimates_of_logs

__all__ = ["calibrate", "estimates_of_logs", "inspect", "judge_campaign", "split_runs"]
