"""Store, combine and factorise the matrices of a system, of PETSc or of another program."""
