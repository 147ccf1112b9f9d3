"""From pixels to scans: sources of frames, background, camera motion, blobs."""
