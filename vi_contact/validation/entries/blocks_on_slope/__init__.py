"""Slide blocks of finite elements down a slope: numbers of SLAMMER."""
