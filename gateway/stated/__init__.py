"""What people state of a vehicle and of a load, and what follows, as the web takes and shows it and files keep it."""
