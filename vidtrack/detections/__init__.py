"""The boxes of a detector, stored in a file, become scans."""
