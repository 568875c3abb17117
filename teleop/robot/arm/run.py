"""A run along a course: one place from tick to tick, which can pause, and which stops before what is in its way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import accumulate
from typing import Final

import numpy as np
from ruckig import ControlInterface

from robot_sim.arm.clearance import Clearance
from teleop.robot.arm.courses import Course
from teleop.robot.arm.limits import Motion
from teleop.robot.arm.pieces import Piece
from teleop.robot.arm.ruckig_work import RuckigWork
from teleop.robot.arm.watch import obstacle_on

_AHEAD: Final = 0.2
"""Time beyond that for stopping for which the way ahead is watched [s]: a person walks 28 cm in it."""
_STANDSTILL: Final = 1e-9
"""Share of the greatest rate that is taken for 0: with less Ruckig raises."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a run is."""

    piece: int
    """Number of the piece; at the end of the course that of all pieces."""
    along: float = 0.0
    """Parameter of the piece."""
    rate: float = 0.0
    """Its rate [1/s]."""
    acceleration: float = 0.0
    """The change of that [1/s^2]."""


@dataclass(frozen=True, slots=True, eq=False)
class RunStep:
    """A tick of a run."""

    motion: Motion
    """How the joints move at its end."""
    share: float
    """Of the course that is done, from 0 to 1."""
    done: bool
    """Whether the end is reached."""
    blocked: str = ""
    """Why the arm stops, for people; empty if nothing is in the way."""


class Run:
    """Owns the place on a course, which begins where the arm stands still.

    A pause, and a stop before an obstacle, are along the course: it is left nowhere. To leave it at once, brake the
    joints from the ``motion`` of the last step.
    """

    def __init__(
        self, course: Course, clearance: Clearance | None = None, *, tick: float = 0.02
    ) -> None:
        """Take a course.

        Args:
            course: What the joints shall do.
            clearance: What measures distances; it looks around between two steps. None if nothing can be in the way.
            tick: Time between two steps [s].
        """
        self.course, self._clearance, self._tick = course, clearance, tick
        self._ruckig = RuckigWork(1)
        self._place = self._entered(0)
        self._known, self._free_to = (-1, -1), 0.0
        lasting = [self._duration(number) for number in range(len(course.pieces))]
        self.schedule = tuple(accumulate(lasting, initial=0.0))
        """Times at which each piece begins and the last one ends, if nothing stops it [s]."""

    def step(self, *, going: bool = True) -> RunStep:
        """Go on for a tick.

        Args:
            going: Whether to move; otherwise the arm stops on its way, and later goes on from there.
        """
        blocked = self._blocked() if going else ""
        self._place = self._onwards(self._place, going and not blocked)
        return RunStep(self._motion(), self._share(), self._over(self._place), blocked)

    def _over(self, place: Place) -> bool:
        return place.piece == len(self.course.pieces)

    def _entered(self, number: int) -> Place:
        if number < len(self.course.pieces) and (piece := self.course.pieces[number]).flying:
            return Place(number, rate=piece.pace.rate)
        return Place(number)

    def _onwards(self, place: Place, going: bool) -> Place:
        """Return the place a tick later; a corner ends the tick."""
        if self._over(place) or not (going or place.rate or place.acceleration):
            return place
        piece = self.course.pieces[place.piece]
        duration = self._work_out(piece, place, going)
        if going and not piece.flying and duration <= self._tick:
            return self._entered(place.piece + 1)
        along, rate, acceleration = (value[0] for value in self._ruckig.path.at_time(self._tick))
        if along >= piece.length:
            return self._entered(place.piece + 1)
        if duration <= self._tick and not going:
            rate = acceleration = 0.0
        return Place(place.piece, along, rate, acceleration)

    def _work_out(self, piece: Piece, place: Place, going: bool) -> float:
        """Work out the parameter's shortest motion to the end of a piece, its rate, or standstill; return its time [s]."""
        given, pace = self._ruckig.given, piece.pace
        to_end = going and not piece.flying
        given.control_interface = ControlInterface.Position if to_end else ControlInterface.Velocity
        given.max_velocity, given.max_acceleration = [pace.rate], [pace.acceleration]
        given.max_jerk = [pace.jerk]
        still = _STANDSTILL * pace.rate
        rate = place.rate if abs(place.rate) > still else 0.0
        given.current_position, given.current_velocity = [place.along], [rate]
        given.current_acceleration = [place.acceleration]
        given.target_position = [piece.length]
        given.target_velocity = [pace.rate if going and piece.flying else 0.0]
        given.target_acceleration = [0.0]
        return self._ruckig.calculate()

    def _duration(self, number: int) -> float:
        piece = self.course.pieces[number]
        if piece.flying:
            return piece.length / piece.pace.rate
        return self._work_out(piece, Place(number), going=True)

    def _blocked(self) -> str:
        """Return what is in the way, as far as the arm must look to stop in time."""
        place = self._place
        if self._clearance is None or self._over(place):
            return ""
        piece = self.course.pieces[place.piece]
        self._work_out(piece, place, going=True)
        ticks = math.ceil((piece.pace.stopping + _AHEAD) / self._tick)
        ahead = [self._ruckig.path.at_time(self._tick * k)[0][0] for k in range(1, ticks + 1)]
        # As long as nothing has moved, what was found to be free a tick ago is so.
        known = self._clearance.changes, place.piece
        begin = max(place.along, self._free_to) if known == self._known else place.along
        poses = piece.at(
            np.array([begin, *(a for a in ahead if a > begin)]).clip(0.0, piece.length)
        )
        blocked = obstacle_on(self._clearance, poses[0, 0], poses[0, 1:])
        self._known, self._free_to = known, place.along if blocked else max(begin, ahead[-1])
        return blocked

    def _motion(self) -> Motion:
        place = self._place
        if self._over(place):
            return Motion.at_rest(self.course.end)
        piece = self.course.pieces[place.piece]
        angles, slopes, bends = piece.at(np.array([place.along]))[:, 0]
        return Motion(
            angles, slopes * place.rate, bends * place.rate**2 + slopes * place.acceleration
        )

    def _share(self) -> float:
        place = self._place
        if self._over(place):
            return 1.0
        begin, end = self.schedule[place.piece : place.piece + 2]
        part = place.along / self.course.pieces[place.piece].length
        return (begin + part * (end - begin)) / self.schedule[-1]
