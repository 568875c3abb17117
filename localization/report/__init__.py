"""The report of a localised log: figures, plots, an HTML page, a rerun recording."""
