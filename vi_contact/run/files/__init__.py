"""Keep a run on disk: histories, checkpoints, logs, the lock, and reading it again."""
