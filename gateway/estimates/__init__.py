"""What an estimate says: the quantities with their errors by source, why one is refused, and all of it as JSON."""
