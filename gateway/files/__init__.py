"""The small files a service keeps beside its database: read warily, replaced in one step, set aside, never deleted."""
