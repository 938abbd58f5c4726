"""The report of a fleet's data set: an overview page with what needs attention, and a page for each vehicle."""

from gateway.reports.fleet.report import write_fleet_report

__all__ = ["write_fleet_report"]
