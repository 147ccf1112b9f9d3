"""Recordings of live cameras: writing them during the run, reading them as a source, deleting them by age and size."""
