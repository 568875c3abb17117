"""The operator's console in the browser: serving the page, access from the local network, QR codes."""
