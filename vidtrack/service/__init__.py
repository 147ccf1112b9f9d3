"""vidtrack as a service of the machine, which systemd starts, watches and restarts."""
