"""A robot in real time: control, gateway, estimator and camera are processes, so that no client can hold up control."""
