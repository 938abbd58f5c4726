"""Files by their bytes: those a service keeps beside its database, that must be signed, that a person asked for."""
