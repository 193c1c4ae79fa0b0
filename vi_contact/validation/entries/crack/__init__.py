"""Close a crack by pressure, and let it slip: a solution in closed form."""
