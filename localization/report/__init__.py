"""Report of a localised log: statistics, figures, an HTML page and a rerun recording."""
