"""Empty a reservoir that a fault has displaced: a solution in closed form."""
