"""The estimator: localises the robot by what control records.

Searching a map takes long at times; here it holds up nothing but the estimate, which catches up by leaving out sweeps
(``backlog``).
"""

from __future__ import annotations

import sys
from contextlib import ExitStack, closing
from typing import Final

from localization.logs.mcap_writer import ReadingsWriter
from localization.maps.prepared_map import prepare
from localization.pipeline.localizer import Localizer
from teleop.robot.estimation import Estimation
from teleop.robot.preview import PreviewRequest
from teleop.robot.real_time.backlog import Backlog
from teleop.robot.real_time.channel import Channel, inherited_channel
from teleop.robot.real_time.child_process import failing_to, stand_back
from teleop.robot.real_time.process_messages import (
    DRIVEN,
    ESTIMATED,
    GATEWAY_BOUND,
    OTHER,
    PREVIEW,
    PREVIEWED,
    EstimatorSetup,
    Ready,
    pack,
    unpack,
)
from teleop.robot.real_time.process_name import name_process
from teleop.robot.recording import Recording
from teleop.robot.steps.precision_log import PrecisionLog, StepsWriter

_NICENESS: Final = 5
"""How far this process stands back behind control where processors are few."""


def run(channel: Channel) -> None:
    """Localise until control ends."""
    payloads = channel.wait()
    setup: EstimatorSetup = unpack(payloads.pop(0))
    estimation = Estimation(Localizer(prepare(setup.cloud, cache=setup.cache), setup.mounts))
    with ExitStack() as cleanup:
        precision = PrecisionLog()
        recording = _recording(setup)
        if recording is not None:
            cleanup.enter_context(closing(recording))
        channel.send(pack(OTHER, Ready()))
        previews: dict[int, PreviewRequest] = {}
        backlog, ended = Backlog(), False
        while backlog or not ended:
            records = [unpack(payload) for payload in payloads if payload[:1] == DRIVEN]
            asked = [unpack(payload) for payload in payloads if payload[:1] == PREVIEW]
            ended = ended or len(records) + len(asked) < len(payloads)
            previews.update((request.client, request) for request in asked)
            if recording is not None:
                for record in records:
                    recording.calls(record.inbox, record.stamp)
            backlog.add([record for record in records if not record.paused])
            if backlog:
                record, needed, left_out = backlog.take()
                for scan in left_out:
                    estimation.localizer.leave_out(scan)
                estimated = estimation.take(needed)
                channel.send(pack(ESTIMATED, estimated))
                if recording is not None:
                    if estimated.estimates:
                        recording.steps(precision.take(record, estimated.estimate))
                    recording.readings(record.readings, record.stamp, record.arm)
                # One for each tick at most, in turn: however many clients ask, the estimate has its time.
                if previews and not backlog.late:
                    request = previews.pop(next(iter(previews)))
                    channel.send(pack(PREVIEWED, estimation.preview(request)))
            # What waits in the pipe is taken first: it says how old the next record is.
            payloads = [] if ended else channel.receive() if backlog else channel.wait()


def _recording(setup: EstimatorSetup) -> Recording | None:
    """Begin the records, if they are wanted."""
    if setup.record is None:
        return None
    log = ReadingsWriter(
        setup.record, setup.mounts, dict(setup.metadata), wheel_radius=setup.wheel_radius
    )
    return Recording(log, setup.record, StepsWriter(setup.record.with_suffix(".steps.csv")))


def main() -> None:
    """Run in the process that control has started."""
    name_process("estimator")
    channel = inherited_channel(int(sys.argv[1]), GATEWAY_BOUND)
    stand_back(_NICENESS)
    with failing_to(channel):
        run(channel)


if __name__ == "__main__":
    main()
