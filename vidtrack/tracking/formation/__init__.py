"""Targets too close together to be followed one by one."""
