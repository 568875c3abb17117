"""Where there is room in a plan: routes, and furniture moved or walls raised with ways between."""
