"""Carries out the commands of a log one after another, each once."""

from __future__ import annotations

import asyncio
from collections import Counter
from dataclasses import replace
from typing import Final

from teleop.bridges.kafka import results
from teleop.bridges.kafka.commands_in_log import Command, Loss
from teleop.bridges.kafka.journal import Journal
from teleop.bridges.kafka.log_reader import LogReader
from teleop.bridges.kafka.results import Result
from teleop.bridges.kafka.robot_link import CommandOutcome, NotSentError, RobotLink
from teleop.clock import unix_seconds
from teleop.step_commands.commands import Step, StepCommand, StepCommandError
from teleop.step_commands.turtle_control import StepSizes, read_turtle_control

_NO_HINDRANCE: Final = (results.DONE, results.SET, results.INVALID, results.INTERRUPTED)
"""Outcomes after which the commands that are waiting are carried out all the same."""

_NOT_DRIVEN: Final = (results.TOO_OLD, results.SKIPPED, results.REPEATED)
"""Outcomes of commands that are passed over; what is waiting is neither helped nor hindered."""

_CLOCKS: Final = 5.0
"""How far ahead of this machine's clock a command's time may be without being refused [s]."""


class CommandDriver:
    """Takes what a reader has read, has the robot do it, and writes the journal.

    Before anything of a command is sent to the robot, the journal says that it is begun; a command that is found begun
    and not ended is answered as interrupted, and not sent again. What is read, but not begun, is read again.
    """

    def __init__(
        self,
        journal: Journal,
        reader: LogReader,
        robot: RobotLink,
        *,
        partition: int,
        key: str | None,
        max_age: float,
        sizes: StepSizes,
    ) -> None:
        """Join the parts.

        Args:
            journal: Where everything is noted.
            reader: What is to be done.
            robot: What does it.
            partition: Partition of the commands.
            key: Key of the robot's commands; None if all are the robot's.
            max_age: Age from which a command is not obeyed [s]; 0 for no limit.
            sizes: Speeds and senses of steps.
        """
        self.counts: Counter[str] = Counter()
        """How many commands of this run had each outcome."""

        self._journal = journal
        self._reader = reader
        self._robot = robot
        self._partition = partition
        self._key = None if key is None else key.encode()
        self._max_age = max_age
        self._sizes = journal.state.sizes(sizes)
        self._inverted_by_option = sizes.right_turns_left
        self._skip_before = 0
        self._interrupted = journal.state.begun

    async def run(self) -> None:
        """Carry out commands without end; the first answer is for the one that was cut off, if any."""
        while True:
            event = await self._reader.events.get()
            if isinstance(event, Loss):
                await self._note_loss(event)
            elif self._key is None or event.key == self._key:
                await self._follow(event)

    async def _follow(self, command: Command) -> None:
        """Carry out a command and note its result."""
        if self._interrupted is not None and command.offset == self._interrupted:
            self._interrupted = None
            sizes, _ = self._read(command)
            why = "the bridge was ended while the command was carried out"
            await self._end(command, CommandOutcome(results.INTERRUPTED, why), sizes)
            return
        sizes, steps = self._read(command)
        if isinstance(steps, CommandOutcome):
            await self._end(command, steps, self._sizes)
        elif not steps:
            await self._end(command, CommandOutcome(results.SET), sizes)
        else:
            await self._end(command, await self._carry_out(command, steps), sizes)

    def _read(self, command: Command) -> tuple[StepSizes, tuple[StepCommand, ...] | CommandOutcome]:
        """Return the sizes from now on and what is to be done, or why nothing is."""
        try:
            return read_turtle_control(command.value or b"", self._sizes)
        except StepCommandError as error:
            return self._sizes, CommandOutcome(results.INVALID, str(error))

    async def _carry_out(self, command: Command, steps: tuple[StepCommand, ...]) -> CommandOutcome:
        begun = False
        while True:
            await self._reachable()
            if (why := self._too_old(command)) is not None:
                return CommandOutcome(results.TOO_OLD, why)
            if not begun and command.mark.digest in self._journal.state.driven_before:
                return CommandOutcome(results.REPEATED, "it was driven before the log began again")
            if command.offset < self._skip_before:
                return CommandOutcome(
                    results.SKIPPED, "it was waiting when a step before it ended badly"
                )
            if not begun:
                await self._journal.begin(command.offset, command.mark)
                begun = True
            try:
                return await self._send(steps)
            except NotSentError:
                await asyncio.sleep(0.05)

    async def _send(self, steps: tuple[StepCommand, ...]) -> CommandOutcome:
        """Have the robot do all of a command; what follows a part that is not done is left."""
        total = CommandOutcome(results.DONE)
        for number, step in enumerate(steps):
            try:
                done = await (
                    self._robot.move(step) if isinstance(step, Step) else self._robot.photograph()
                )
            except NotSentError:
                if number == 0:
                    raise
                done = CommandOutcome(
                    results.INTERRUPTED, "the robot was lost before all of it was done"
                )
            message = "; ".join(filter(None, (total.message, done.message)))
            total = CommandOutcome(
                done.outcome, message, total.distance + done.distance, total.angle + done.angle
            )
            if done.outcome != results.DONE:
                break
        return total

    async def _reachable(self) -> None:
        """Wait until both sides are connected: without either, nothing is begun."""
        while not (self._robot.reachable.is_set() and self._reader.reachable.is_set()):
            await self._robot.reachable.wait()
            await self._reader.reachable.wait()

    def _too_old(self, command: Command) -> str | None:
        """Return why a command is too old; waiting for steps before it does not count, for a connection it does."""
        if not self._max_age:
            return None
        since = max(self._robot.since, self._reader.since)
        at = command.arrived if command.arrived >= since else unix_seconds()
        age = at - command.timestamp / 1e3
        if age > self._max_age:
            return f"{age:.1f} s old, the limit is {self._max_age:g} s"
        if age < -_CLOCKS:
            return f"its time is {-age:.1f} s ahead of this machine's clock"
        return None

    async def _end(self, command: Command, outcome: CommandOutcome, sizes: StepSizes) -> None:
        if outcome.outcome not in (*_NO_HINDRANCE, *_NOT_DRIVEN):
            # Whoever sent what is there by now could not know of it.  # words: ok
            self._skip_before = self._reader.end
        result = Result(
            self._partition,
            command.offset,
            self._journal.state.log,
            outcome=outcome.outcome,
            message=outcome.message,
            distance=outcome.distance,
            angle=outcome.angle,
        )
        self.counts[outcome.outcome] += 1
        self._sizes = sizes
        inverted = sizes.right_turns_left
        await self._journal.end(
            *(result, command.mark, command.end, sizes),
            inverted=None if inverted == self._inverted_by_option else inverted,
        )

    async def _note_loss(self, loss: Loss) -> None:
        state = self._journal.state
        number = state.log + int(loss.again)
        if self._interrupted is not None and (loss.again or self._interrupted < loss.next):
            # The log no longer has the command; its answer is owed all the same.
            await self._answer_without_command(self._interrupted)
            self._interrupted = None
        await self._journal.open_log(log=number, next=loss.next, end=loss.end, mark=loss.mark)
        if loss.again:
            self._skip_before = 0
        if loss.lost or loss.again:
            self.counts[results.LOST] += loss.lost
            result = Result(self._partition, loss.next, number, results.LOST, loss.reason)
            await self._journal.end(replace(result, lost=loss.lost), None, loss.end, self._sizes)

    async def _answer_without_command(self, offset: int) -> None:
        result = Result(
            *(self._partition, offset, self._journal.state.log, results.INTERRUPTED),
            "the bridge was ended while the command was carried out; the log has lost it since",
        )
        self.counts[results.INTERRUPTED] += 1
        await self._journal.end(result, None, self._journal.state.end, self._sizes)
