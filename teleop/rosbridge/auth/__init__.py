"""Who may connect and what each client may do: tokens, roles, origins, TLS."""
