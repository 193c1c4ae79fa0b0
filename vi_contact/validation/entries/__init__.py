"""Hold the entries of the validation book, a folder for each."""
