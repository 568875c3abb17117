"""Simulation in MuJoCo of a skid-steered robot with planar lidars, encoders and an inertial unit."""

from robot_sim.actors.extras import (
    AddedBox as AddedBox,
    ClosedDoor as ClosedDoor,
    PassingPerson as PassingPerson,
    Spare as Spare,
)
from robot_sim.drive.aria_packets import StandardPacket as StandardPacket
from robot_sim.drive.bumpers import Bumpers as Bumpers
from robot_sim.drive.drivetrain import DriveConfig as DriveConfig, SlipFault as SlipFault
from robot_sim.drive.motor_controller import (
    FirmwareConfig as FirmwareConfig,
    MotionCommand as MotionCommand,
)
from robot_sim.drive.robot_condition import Condition as Condition
from robot_sim.drive.wheel_slip import Slip as Slip
from robot_sim.errors import (
    PhysicsError as PhysicsError,
    SensorError as SensorError,
    SimulationError as SimulationError,
    UnknownSceneError as UnknownSceneError,
    WorldError as WorldError,
)
from robot_sim.floorplan.doorways import Doorway as Doorway, doorways as doorways
from robot_sim.floorplan.scene_folders import scene_names as scene_names
from robot_sim.raycasting import (
    Hits as Hits,
    MujocoRayCaster as MujocoRayCaster,
    RayCaster as RayCaster,
    caster_for as caster_for,
)
from robot_sim.robot.imperfections import Imperfections as Imperfections
from robot_sim.robot.p3at import IMU_MOUNT as IMU_MOUNT, MOUNTS as MOUNTS, P3AT as P3AT
from robot_sim.robot.platforms import HUSKY as HUSKY, JACKAL as JACKAL, PLATFORMS as PLATFORMS
from robot_sim.robot.skid_steer_parameters import SkidSteer as SkidSteer
from robot_sim.scene_objects.floor_surfaces import (
    SURFACES as SURFACES,
    Patch as Patch,
    Surface as Surface,
)
from robot_sim.sensors.imu import InertialConfig as InertialConfig
from robot_sim.sensors.imu_models import INERTIAL_UNITS as INERTIAL_UNITS
from robot_sim.sensors.lidar import ScannerConfig as ScannerConfig
from robot_sim.sensors.lidar_effects import Effects as Effects
from robot_sim.sensors.lidar_models import LIDARS as LIDARS
from robot_sim.sensors.scanner_fault import ScannerFault as ScannerFault
from robot_sim.sensors.sensor_suite import SensorSuite as SensorSuite, sensor_suite as sensor_suite
from robot_sim.simulation import (
    TICK_NS as TICK_NS,
    Simulation as Simulation,
    SimulationConfig as SimulationConfig,
    Truth as Truth,
)
from robot_sim.worlds.from_mjcf import load_mjcf as load_mjcf
from robot_sim.worlds.loading import load_world as load_world, parse_world as parse_world
from robot_sim.worlds.world import World as World, WorldOptions as WorldOptions
