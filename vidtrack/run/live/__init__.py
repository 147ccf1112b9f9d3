"""A live run: a camera becomes tracks for weeks, and the results outlive whatever happens to it."""
