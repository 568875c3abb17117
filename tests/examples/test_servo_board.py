"""The Arduino sketch, compiled for this machine: it reads, moves and answers as the board of the simulation does."""

from __future__ import annotations

import random
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from robot_sim.arm.arm_table import load_arm
from robot_sim.arm.servo import Resolution
from robot_sim.arm.servo_board import COUNTS, counts_of, tenths_of
from robot_sim.arm.servo_firmware import ServoFirmware, checked, decimal

ROOT = Path(__file__).resolve().parents[2]
SKETCH = ROOT / "examples/servo_board/servo_board.ino"
SHIM = Path(__file__).with_name("servo_board")
TABLE = load_arm()
LOWER = ServoFirmware(TABLE).lower

pytestmark = [
    pytest.mark.process,
    pytest.mark.skipif(shutil.which("c++") is None, reason="there is no C++ compiler"),
]


class Sketch:
    """The sketch as a program, to which time and characters are given."""

    def __init__(self, program: subprocess.Popen[str]) -> None:
        self._program = program

    def order(self, text: str) -> tuple[bytes, list[int]]:
        """Return the characters that it has sent, and its pulses [us], 0 where a servo gets none."""
        assert self._program.stdin is not None
        assert self._program.stdout is not None
        self._program.stdin.write(text + "\n")
        self._program.stdin.flush()
        sent, *pulses = self._program.stdout.readline().rstrip("\n").split(" ")
        return bytes.fromhex(sent), [int(pulse) for pulse in pulses]


@pytest.fixture(scope="module", params=[(0, 1), (1, 1), (1, 0)], ids=str)
def compiled(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, bool, Resolution]:
    feedback, whole_degrees = request.param
    program = tmp_path_factory.mktemp("sketch") / "sketch"
    defined = [
        f'-DSKETCH="{SKETCH}"',
        f"-DFEEDBACK={feedback}",
        f"-DWHOLE_DEGREES={whole_degrees}",
    ]
    checks = ["-std=gnu++11", "-Wall", "-Wextra", "-Werror", "-fsanitize=undefined,address"]
    subprocess.run(
        ["c++", *checks, *defined, f"-I{SHIM}", str(SHIM / "board.cpp"), "-o", str(program)],
        check=True,
        timeout=120,
    )
    return program, bool(feedback), "degree" if whole_degrees else "microsecond"


@contextmanager
def running(program: Path) -> Iterator[Sketch]:
    with subprocess.Popen(
        [str(program)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            yield Sketch(process)
        finally:
            assert process.stdin is not None
            process.stdin.close()
            assert process.wait(10) == 0


def some_line(rng: random.Random) -> bytes:
    """Return a good line, one that is nearly good, or garbage."""
    words = [decimal(zero + rng.randint(-1, 1801)) for zero in LOWER]
    match rng.randrange(12):
        case 0:
            words[rng.randrange(6)] = rng.choice(["nan", "", "-", "1.", ".5", "1000.0", "1.25"])
        case 1:
            words.append("0.0")
        case 2:
            return bytes(rng.choices(range(256), k=rng.randrange(150))) + b"\n"
    line = bytearray(checked("J " + " ".join(words)))
    match rng.randrange(8):
        case 0:
            line[rng.randrange(len(line))] = rng.randrange(256)
        case 1:
            begin = rng.randrange(len(line))
            del line[begin : begin + rng.randrange(8)]
        case 2:
            line *= 2
    return bytes(line)


def test_the_sketch_answers_and_moves_as_the_simulated_board(
    compiled: tuple[Path, bool, Resolution],
) -> None:
    program, feedback, resolution = compiled
    rng, board = random.Random(7), ServoFirmware(TABLE, resolution, feedback=feedback)
    shares = [rng.random() for _ in range(6)]
    lines = moved = 0
    with running(program) as sketch:
        standing = [tenths_of(share) for share in shares]
        before = sketch.order("t 19")[0]
        for n, share in enumerate(shares):
            sketch.order(f"c {n} {counts_of(share)}")
        for frame in range(600):
            if rng.random() < 0.5:
                data = some_line(rng)[: rng.choice([1000, 1000, 1000, 9])]
                lines += 1
                board.take(data, standing)
                sketch.order(f"b {data.hex()}")
            sent, pulses = sketch.order(f"t {1 if frame == 0 else 20}")
            board.frame()
            assert before + sent == board.answer(standing), frame
            before = b""
            assert pulses == (board.pulses or [0] * 6), frame
            moved += board.pulses is not None
    assert lines > 200
    assert moved > 300


def test_the_sketch_has_the_limits_of_the_arms_table(
    compiled: tuple[Path, bool, Resolution],
) -> None:
    program, *_ = compiled
    inside = " ".join(decimal(zero) for zero in LOWER)
    beyond = " ".join(decimal(zero + 1800) for zero in LOWER)
    with running(program) as sketch:
        sketch.order(f"b {checked(f'J {inside}').hex()}")
        sketch.order(f"b {checked(f'J {beyond}').hex()}")
        assert b"E" not in sketch.order("t 20")[0]
        for n, zero in enumerate(LOWER):
            words = inside.split()
            words[n] = decimal(zero - 1)
            sketch.order(f"b {checked('J ' + ' '.join(words)).hex()}")
            assert f"E range {n + 1}".encode() in sketch.order("t 20")[0]


def test_the_sketch_reads_potentiometers_as_the_simulated_converter() -> None:
    low, high = COUNTS
    assert f"{{{low}, {high}}}" in SKETCH.read_text()
