"""The report of a site as a page, pictures and spreadsheets."""
