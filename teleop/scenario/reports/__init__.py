"""Reports of a run: table, JUnit XML, JSON, and one HTML page."""
