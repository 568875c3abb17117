"""Access from the local network: token, certificate, addresses, QR code."""
