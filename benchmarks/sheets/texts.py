"""What stands around the tables of the sheets in ``docs/sheets``: their headings, and how to read their columns."""

from __future__ import annotations

from typing import Final

ACCURACY: Final = """\
# Sheet: accuracy of the localiser

Printed by `python -m benchmarks.sheets` from `benchmarks/results/*.json`; a test compares the two. [Accuracy](../accuracy.md)
reads it, and says what the figures mean and which goals are missed.

*met, not proved*: the figure meets the goal, but not all of its interval does. Bounds are 95 %: of an ATE from bootstrapped
stretches of 5 s, of shares Wilson's, of alarm rates Garwood's. ATE is the rms error of position without alignment [cm];
*max* and *tilt* are the largest errors. Errors count from 2 s after the robot was placed. Of the other methods the ATE and
the largest error are given. NEES(6) is consistent at 6.

## Methods

Each case is driven once, steered by the true pose; every method gets the same readings.

- *KISS to map*: KISS-ICP's registration against the cloud (voxels of 0.2 m with 20 points, one thread, every point of the
  sweep, without its adaptive threshold), in our filter with a fixed covariance of 2 cm and 0.5 degrees.
- *small_gicp*: its point-to-plane ICP with its own normals, in our filter with the covariance from its Hessian.
- *Monte Carlo*: our adaptive particle filter with likelihood field and nav2_amcl's default numbers, on deskewed horizontal
  scans and the odometry of wheels and gyro, started at the true pose. It has not been compared with nav2_amcl itself. It
  estimates no height, roll or pitch, and is given the true height. It gets sweeps when they arrive, with the odometry of
  their own time.

The first two use our gates, accept late readings, and are relocated by our search; they have no KISS-ICP odometry and no
wider priors. The computing time of *KISS to map* is that of every point of the sweep; thinned points take about half.

## Tracking

{localization-drives}

## Searches, speed, consistency, faults

*Right* means within 10 cm and 2 degrees. The rows *kiss opinion* time a part that has been removed since.

{localization-others}

{localization-missing}

## False alarms

{localization-alarms}

## False alarms among people, and robots that are carried off

{people-alarms}

{people-facts}

## What each part contributes

Each row is the localiser without one mechanism; *all* is the whole. `=`: every figure of that drive, except CPU time, is that
of *all*; an empty cell was not run. *position* is the rms error [cm], *heading* likewise [degrees]; *wrong* the share of
sweeps with an error above 0.5 m or without a pose, *doubt* the share in a state other than `tracking`, `degraded` or
`slipping`, *mount warned* the share with a warning about the mounts [%]; *fails after* the time until the first wrong scan
[s]; *mean* the mean position error against corrected scans that the map was not made of, *relations* the same against
relations that people checked [cm]; *first jump* the time at which the estimate left its odometry by more than 1 m [s], `-`
if it never did. A *stressed* drive has four bursts in which all wheels report twice their speed for a second, both scanners
silent for 3 s, and people and moved furniture where the scene has them. *put wrong*: of 24 estimates that were put wrong,
how many ever were, how many of these were said, and the longest time in which one was trusted [s]. *kidnaps*: of 8 robots
carried off on a log, how many were not in doubt before, said so within 2 s, and recovered; the time in which they were
trusted though wrong [s]; false alarms.

{ablation}

{ablation-missing}

{ablation-facts}

## Weights of the belief

`belief`: 40 robots carried off in each of eight simulated drives and on each of five logs. Each sweep says whether the pose
that it was compared with was right (within 25 cm and 10 degrees) or wrong (beyond 50 cm or 20 degrees). The weights of half
of the places are judged on the other half, both ways, and those that ship on each.

{belief}

{belief-facts}

## Real logs

Every method gets an occupancy grid of 5 cm made of every second corrected scan, the corrected pose of the first scan as its
start, the log's scans and odometry, and one setting for all logs:

| method | setting |
|---|---|
| Farsteer | its defaults for odometry and one level scanner |
| KISS-ICP + wheels | point-to-point alignment of each scan to the whole map, begun where odometry leads; voxels of 0.2 m with 20 points, correspondences within 0.5 m, kernel 0.1 m |
| small_gicp + wheels | point-to-plane ICP begun in the same way; correspondences within 0.5 m, which on the first 120 s of each log is better than the default of 1 m; each scan at three heights, because one level alone would let it tilt against upright walls |
| Monte Carlo | as above; between its updates the pose is carried on by odometry |
| yardstick | a script of somebody else (`--yardstick`): odometry, then planar point-to-line ICP with an odometry prior, on its own map of the same scans |

KISS-ICP and small_gicp accept every alignment here: no gates, no state, no covariance.

- *error*: distance of the scanner's position from the corrected one, at the corrected scans that are not in the map.
- *relations*: error of the position of one scan in another, against the relations, mean and standard deviation.
- *wrong*: share of scans with an error above 0.5 m, or without a pose after the robot was placed. *Trusted though wrong*:
  share that is wrong in the state `tracking`, `degraded` or `slipping`. *Tracking where right*: share of `tracking` among the
  scans with an error below 0.15 m.
- *NEES(3)* of x, y and heading, with 3 cm and 0.5° for the reference's own error; 3 is consistent. *Relations within 95 %*:
  share inside the bound of both poses' covariances, taken as independent.
- *95 % interval* of the percentile: by the ranks of the errors, taken as independent.
- *CPU per scan*: one thread, with all readings since the scan before, without garbage collection of the loaded log; medians
  of one log differ by a fifth between runs. The yardstick reports only its mean, by the wall clock.
- `-`: the method does not report it. *turns x*: the turns of the odometry multiplied. *stamps even*, *stamps shaken*: lines
  evenly over time, or each off by up to 50 ms.

{real-scores}

### Kidnapped

{real-kidnaps}

### Starts

{real-hints}

{real-facts}

## When and where it was measured

{localization-facts}
"""

KNOWING: Final = """\
# Sheet: who knows that the pose is wrong

Printed by `python -m benchmarks.sheets` from `benchmarks/results/real.json`; a test compares the two. Fifty robots are carried
off on each of the public [logs](../localization.md#public-logs) below, as Fox, Burgard and Thrun (1999) carry theirs: ten seconds of
the log from one place, and at once, without a gap in time or odometry, at least half a minute and three metres from another,
four metres away or more. The same robot that is not carried off counts the false alarms.

```sh
.venv/bin/python -m benchmarks real FOLDER --kidnaps 50 --out benchmarks/results    # the folder holds the logs
.venv/bin/python -m benchmarks.sheets
```

| rule | asked of | says that the pose is wrong where |
|---|---|---|
| Farsteer | its localiser | the state is `suspect`, `lost` or `relocalising` |
| als_ros: mean absolute error | a particle filter | the mean distance of beams' ends from the map, of those within 1 m, exceeds 0.225 m: the classifier that [als_ros](https://github.com/NaokiAkai/als_ros) ships (Akai, Journal of Field Robotics 2023) |
| amcl: warning level | the same | a standard deviation of the particles exceeds 0.2 m or 0.1 rad: the defaults of [amcl](https://github.com/ros-planning/navigation/pull/807) |

The particle filter is ours, with nav2_amcl's default numbers, the map of every second corrected scan, and the true pose to
begin with. als_ros itself goes on from its classifier, with a filter over time and places drawn from the whole map; only the
rule is tried here. It was trained on other scanners and maps.

- *n*: robots carried off; in brackets those whose pose was right within 0.3 m and 10 degrees before, with the rule silent.
  The others are not counted in what follows.
- *said*: share of these of which the rule said so, within 2 s and within half a minute. On `fr101` and `seattle` a
  scan comes only every 2 to 7 s.
- *false alarms*: beginnings of an alarm of the robot that was not carried off, and *alarmed without a kidnap* the share of its
  scans; of the particle filter only those at which its pose is right, of Farsteer all.

{real-knowing}

{real-knowing-facts}
"""

ARM: Final = """\
# Sheet: the arm

Printed by `python -m benchmarks.sheets` from `benchmarks/results/arm.json`; a test compares the two. `python -m benchmarks arm`
measures it: how it follows hands beside mink, plans beside OMPL's, boxes in its jaws, its mirror of hobby servos, a million steps of hands
among boxes, and what it costs. [The arm](../arm.md) says what it does.

{arm}

{arm-missing}

{arm-facts}
"""

GUARD: Final = """\
# Sheet: the guard

Printed by `python -m benchmarks.sheets` from `benchmarks/results/guard.json`; a test compares the two. `python -m benchmarks
guard FOLDER` measures it: drives of 120 s by drivers who mean ill (random, along walls, in bursts, backwards, in turbo, up to
2 s late) in five scenes, each as it was mapped, and with its people and moved furniture; physics and scanners, no localiser.
*Over the wire* they are clients of whole robots. *Round trips* are those of the library's own operators, twelve drives to a
place past moved furniture, of at most 300 s each, without limits on old commands. [Safety](../safety.md) reads it.

*What is seen*: things that the horizontal scanner's plane crosses. *Lower and higher*: all others. A robot *stands* whose
fastest point is slower than 0.05 m/s, what its brake takes away in 0.05 s. What is touched again
within two seconds is the same contact, and a person's two legs are one.

{guard}

{guard-facts}

## What fails while somebody drives

`python -m benchmarks failures FOLDER` measures it, and a test compares these tables with `benchmarks/results/failures.json`:
whole robots in real time in the courtyard, and drivers in processes of their own. The wheels' rates in the robot's log say
when they begin to brake (at most 0.5 s, a tick, and 0.05 s for the servos after the failure), how far the robot comes (the
bound of [Safety](../safety.md)) and that it does not drive on. Not counted are trials in which the robot hardly moved, or whose
log ends because the estimator that writes it is killed in the next. Some were made beside other work of low priority.

Seeds 677 and 809 came 7 ms late while readings 20 ms apart decided. Each was made four times more once the time between
readings counted, and the first of these stands below: 677 braked after 0.568, 0.562, 0.558 and 0.570 s, the last less than
1 ms late, 809 after 0.540, 0.545, 0.552 and 0.527 s. A robot that still gains speed seems up to 10 ms late. The sums were
counted anew from the kept trials, which takes no time.

{failures}

{failures-facts}
"""

PATH: Final = """\
# Sheet: the predicted path

Printed by `python -m benchmarks.sheets` from `benchmarks/results/path.json`; a test compares the two. `python -m benchmarks
path` measures it: tours of 60 s in four scenes with two seeds, through the whole robot in lockstep. At each fifth tick a display
that is a round trip behind says where the robot will be when a command sent then takes effect, and the true pose of that time
judges. *dead* shows the newest estimate, *constant* carries it on with its own speeds, *late* is ours where the link takes 50 ms
longer than was measured. [Teleoperation](../teleoperation.md#where-the-robot-will-be) has the model.

{path}

{path-facts}
"""

CONSOLE: Final = """\
# Sheet: the console page

Printed by `python -m benchmarks.sheets` from `benchmarks/results/console.json`; a test compares the two. `python -m benchmarks
console` measures the page in Debian's Chromium, without a graphics card; *script time* is that of the page's own process.
[The console](../console.md) says what the page does.

{console}

{console-facts}
"""

CATALOGUES: Final = """\
# Sheet: scanners, inertial units, materials, furniture

Printed by `python -m benchmarks.sheets` from the catalogues in the code, which name the source of each figure; a test compares the
two. [Sensors](../sensors.md) and [Worlds](../worlds.md) explain them.

## Scanners

{scanners}

## Inertial units

{inertial-units}

## Materials

{materials}

## Furniture

{furniture}
"""

LIMITS: Final = """\
# Sheet: joystick, queues and limits

Printed by `python -m benchmarks.sheets` from the dataclasses that hold the values; a test compares the two.
[Teleoperation](../teleoperation.md) says what they are for.

## Joystick

The shipped layout, `assets/joysticks/default.json`, has the defaults of `JoystickLayout`; up and left are +1.

{joystick}

## Queues and keep-alive

For each client (`QueueLimits`, `Keepalive`). Beyond `control` or `lossless` a client is disconnected with code 1013, beyond
`auth_timeout` with 1008.

{queues}

## Limits of clients

The defaults of `ClientLimits`.

{clients}
"""

RULES: Final = """\
# Sheet: rules of the fuzzer

Printed by `python -m benchmarks.sheets` from the code, as by `farsteer fuzz --rules`; a test compares the two.
[Fuzzing](../fuzzing.md) says what they read, and which exceptions there are.

{rules}
"""
