"""Hold constants of nature in SI units."""

from __future__ import annotations

STANDARD_GRAVITY = 9.80665
"""Standard gravity [m/s²], the g of every record file."""
