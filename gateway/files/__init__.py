"""Files by their bytes: those a service keeps beside its database, those somebody must have signed."""
