"""Live capture: frames with capture times from cameras and streams, across lost connections."""
