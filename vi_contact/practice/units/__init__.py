"""Read units that people write, and write numbers in the units that a report has chosen."""
