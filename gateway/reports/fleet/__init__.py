"""The report of a fleet's data set: an overview page with what needs attention, and a page for each vehicle."""
