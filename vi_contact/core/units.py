"""Hold constants of nature in SI units."""

STANDARD_GRAVITY = 9.80665
"""Standard gravity [m/s²], the g of every record file."""
