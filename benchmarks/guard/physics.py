"""The drivers with physics and scanners alone: no localiser, no socket."""

from __future__ import annotations

from benchmarks.guard.drivers import DRIVERS, Nearest
from benchmarks.guard.judge import DRIVE, Judge, Outcome, Plan
from benchmarks.guard.worlds import world_of
from localization.types import SECOND, Scan, Twist
from robot_sim import TICK_NS, Simulation
from teleop.joystick import VelocityRequest
from teleop.robot.drive import Drive
from teleop.robot.guard.guard import Guard
from teleop.robot.inbox import DriveCommand


def drive(plan: Plan, seconds: float = DRIVE, make: type[Guard] = Guard) -> Outcome:
    """Make one drive of so many seconds, with a guard of this kind."""
    world = world_of(plan.scene, plan.alive)
    simulation = Simulation(world, seed=plan.seed)
    guard = make(world.robot, simulation.mounts, simulation.config.drive) if plan.guarded else None
    robot, judge = Drive(simulation, guard=guard), Judge(world)
    draw, nearest, until = DRIVERS[plan.driver], None, 0
    rng = plan.rng()
    for tick in range(round(seconds * SECOND / TICK_NS)):
        if tick >= until:
            stick = draw(rng, nearest)
            until = tick + stick.ticks
        request = VelocityRequest(Twist.planar(stick.forward, stick.turn), enabled=True)
        command = DriveCommand("driver", request, age=stick.age, stream=True)
        record = robot.tick(simulation.stamp, (command,))
        for scan in record.sensed:
            if isinstance(scan, Scan) and scan.scanner == "laser_horizontal":
                nearest = Nearest.of(scan.ranges, scan.angles)
        judge.take(record)
    return judge.outcome(plan)
