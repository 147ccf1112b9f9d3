"""What a report of a site says: from the tables of `vidtrack measure` to sheets, peak hours, speeds and paths."""
