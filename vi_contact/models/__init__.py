"""Hold problems ready to run: a value that describes one, and ``build``, which makes the contact problem of it."""
