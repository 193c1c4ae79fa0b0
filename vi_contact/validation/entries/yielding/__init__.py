"""Let bodies yield: a squeezed cube, a thrown column, a pressed plate of soil."""
