"""Deferred decisions: track splitting and multiple hypothesis tracking."""
