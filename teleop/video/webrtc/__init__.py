"""Pictures by WebRTC: the answer to an offer, the connection, and a page that plays it."""
