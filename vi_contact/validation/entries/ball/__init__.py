"""A ball that strikes thick glass at an angle."""
