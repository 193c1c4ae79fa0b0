"""Tell which columns of a history belong together, by the beginnings of their names."""

# Columns of the recorder Uplift, which are forces of water, and no open shares of parts.
FORCES_OF_WATER = ("uplift_force", "uplift_effective")


def begins(column: str, prefixes: tuple[str, ...]) -> bool:
    """Say whether a column begins with one of the prefixes; a force of water is asked for whole."""
    return column in prefixes if column in FORCES_OF_WATER else column.startswith(prefixes)
