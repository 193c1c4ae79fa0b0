"""Solve for normal reactions on the contact points: the linear complementarity problem."""
