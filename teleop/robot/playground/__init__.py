"""The playground of a simulated robot: clients change its world while it runs. Only with ``--playground``."""
