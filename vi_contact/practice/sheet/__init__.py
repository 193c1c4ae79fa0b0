"""Write page 1 of a report: who made it, the numbers that decide, and whether they converge."""
