"""Control of a simulated world by the services of ``simulation_interfaces``, for referee and playground alike."""
