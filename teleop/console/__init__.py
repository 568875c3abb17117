"""The operator's console in the browser: the page, serving it, and access from the local network."""
