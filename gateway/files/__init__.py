"""Files: the service's own beside its database, and output files that are replaced in one step."""
