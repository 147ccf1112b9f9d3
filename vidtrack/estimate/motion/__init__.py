"""Motion models: how a target moves between two scans."""
