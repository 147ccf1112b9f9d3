"""Live runs: cameras tracked for weeks. Results stay valid after crashes, kills, full disks and lost connections."""
