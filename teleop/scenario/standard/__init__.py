"""The field's standard services of simulators, ``simulation_interfaces`` 2.1, and who may call them."""
