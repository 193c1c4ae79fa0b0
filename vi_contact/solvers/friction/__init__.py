"""Solve for normal and tangential reactions on the contact points, Tresca or Coulomb."""
