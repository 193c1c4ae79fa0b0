"""Read case files: TOML tables to values, by an allow-list of words."""
