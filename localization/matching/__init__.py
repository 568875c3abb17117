"""Registration of sweeps against the prebuilt cloud, and how well the two agree."""
