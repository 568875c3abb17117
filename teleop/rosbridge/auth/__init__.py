"""Authentication and permissions of clients: tokens, rosauth codes, roles, origins, TLS."""
