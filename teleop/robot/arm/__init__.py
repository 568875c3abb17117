"""Control of the arm: from what clients want to the angles of the next tick."""
