"""What lies on disk: where, a run's folder and its logs, and writing that a crash cannot halve."""
