"""Push a wedge up a slope: NAFEMS CGS-4."""
