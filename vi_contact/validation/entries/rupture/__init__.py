"""Let a fault in the plane rupture: arrivals and slips of an independent program."""
