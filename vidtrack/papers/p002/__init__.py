"""Paper 002: Jung, Kim and Hong, theoretical analysis and performance prediction for PSN filter tracking (2002)."""
