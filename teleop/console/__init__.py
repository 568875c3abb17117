"""The operator's console: a page for any browser, and what serves it."""
