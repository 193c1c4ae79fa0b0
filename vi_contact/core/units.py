"""Hold constants of nature in SI units."""

STANDARD_GRAVITY = 9.80665
"""Standard gravity [m/s²], the g of every record file."""

WATER_WEIGHT = 1000.0 * STANDARD_GRAVITY
"""Weight of fresh water [N/m³]."""
