"""Files: the service's own beside its database, signed files, and output files that are replaced in one step."""
