"""Live capture: cameras and streams become frames with true times, whatever happens to the connection."""
