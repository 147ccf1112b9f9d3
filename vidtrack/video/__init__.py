"""From video to scans: sources of frames, background, camera motion, blobs."""
