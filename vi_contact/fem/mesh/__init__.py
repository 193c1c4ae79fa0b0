"""Hold nodes, cells and their named groups, shared among ranks."""
