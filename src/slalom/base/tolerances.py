"""Numerical constants that several packages share: unit, reason of the value, what changes if it changes."""

from typing import Final

CONTACT: Final = 2.5e-7
"""[m] Elements are grown by this much before a choice is sought outside them.

It makes the exchange end (each new element covers a small ball around the control that it rejects) and
it absorbs rounding. A safe control that would come nearer to an obstacle than this is not found.
Larger: fewer exchanges, a choice farther from the optimum. Smaller than about 1e-9 m: rounding decides.
"""

OVERLAP: Final = 1e-5
"""[m] A robot that is deeper in an obstacle than this overlaps it; less deep, it touches it.

More than CONTACT_SLACK + CERTIFIED + CONTACT: a robot that touches a body may be that deep in it until its next
decision. Larger: deeper overlaps count as contact. Smaller: a safe choice counts as an overlap at the next decision.
"""

CONTACT_SLACK: Final = 5e-6
"""[m] A robot nearer than this to an obstacle touches it: the obstacle counts as smaller by up to this much.

More than the sum of CONTACT and CERTIFIED, so that a robot in contact may still move away although radii
are grown by those. Larger: contact at larger distances permits controls; smaller: all controls of a robot in contact
are blocked.
"""

INTERPOLATION: Final = 1e-6
"""[m] Largest error of the cubic pieces that stand for a curve; it is added to the radius.

Straight, quadratic and cubic motion has error 0. A circle of 20 m needs about 6 pieces per radian.
Ten times larger: 1.8 times fewer pieces, obstacles thicker by as much.
"""

CERTIFIED: Final = 4 * INTERPOLATION
"""[m] How far a certified clearance may lie below the true one.

The pieces of the obstacle and those of the response may each be off by INTERPOLATION, and each error is added to the
radius. It is 0 for straight, quadratic and cubic motion and half as much for responses that are exactly cubic.
"""

CLEARANCE: Final = 1e-9
"""[m] How far a reported clearance may lie above the true minimum, and how deep a collision with a hull may go unseen.

Larger: faster, less exact reports. Smaller: motions along a wall take longer. It must stay well below CONTACT.
"""

RESOLVED: Final = 1e-14
"""[1] Share of the largest length in a distance to which the distance is sought, where that exceeds CLEARANCE.

It acts on lengths above CLEARANCE / RESOLVED = 100 km. Larger: distances of large bodies are less exact. Smaller:
motion along a large body takes longer; below about 1e-15 rounding errors are compared, and a bisection does not end.
"""

TIME: Final = 1e-9
"""[1] Width, as a share of one cubic piece, to which the time of a first contact is bracketed."""

ADMISSIBLE: Final = 1e-9
"""[1] Relative excess over a limit that counts as obeying it (rounding of projections and intersections)."""

JUMP: Final = 1e-4
"""[m] By how much two pieces of a trajectory may miss each other where they meet.

Planners print coefficients with six digits; larger gaps are mistakes in the input and are refused.
"""

DEPTH: Final = 40
"""[1] Most bisections of one cubic piece: beyond it the piece is shorter than rounding can resolve."""

ELEMENTS: Final = 4096
"""[1] Most elements in the working set of one choice. Reaching it is a status (UNDECIDED), never an answer."""

CANDIDATES: Final = 2_000_000
"""[1] Most candidate controls examined in one choice. Reaching it is a status (UNDECIDED), never an answer."""

COMMITTED_SLACK: Final = CONTACT + CERTIFIED
"""[m] A committed manoeuvre counts as still safe down to minus this clearance.

It was chosen with clearance >= 0 over other knots; the interpolation errors and one contact tolerance may
lie between the two tests. Smaller: manoeuvres that are still safe are dropped by rounding.
"""

REST: Final = 1e-6
"""[m/s] A robot slower than this is at rest: it has no heading but the one that it was given.

Bounds in the frame of the body need a heading. Larger: a slow vehicle may start off sideways. Much smaller: rounding of
the velocity decides where a robot at rest faces.
"""

STILL: Final = 0.1
"""[1] An element that moves less than this share of a boundary's tolerance stands: its outline is an arc there.

Larger: corners of the boundary are off by as much. Smaller: more points where an envelope begins, ends or bends
sharply.
"""

BRAKING_SHARE: Final = 0.75
"""[1] A robot that stops at its goal approaches no faster than this share of its largest acceleration brakes.

Larger: later arrivals are avoided, but small disturbances make it overshoot. Smaller: it approaches more slowly.
"""

BALL_ROUNDING: Final = 1e-9
"""[1] Share (and [m]) by which bounding balls are larger than computed, for rounding.

Smaller than the rounding of a few operations: a robot that can be met might be left out.
"""

REST_DURATION: Final = 1e6
"""[s] How long a robot at rest is predicted to stay: longer than any run.

Larger: times lose digits. Smaller: the robot is predicted to move on within a long run.
"""

AIM_FIRST: Final = 0.02
"""[s] Earliest time at which a robot aims to be at a goal that it passes.

Larger: a goal just ahead is aimed at too late. Smaller: the grid of times is coarser elsewhere.
"""

AIM_LATEST: Final = 4.0
"""[1] Latest time of the aim: this many times the time to the goal at maximum speed, and the time to reach that speed.

Larger: the grid of times is coarser. Smaller: a robot that has to turn first does not aim at its goal exactly.
"""

AIM_TIMES: Final = 64
"""[1] Times, in geometric progression, at which a control that reaches the goal is sought.

Larger: an earlier aim at more cost. Smaller: the aim is later than it could be.
"""

DIVISOR_FLOOR: Final = 1e-9
"""[m, m/s or m^2/s^2] Least length, speed or squared speed that guidance divides by.

It avoids 0 / 0 for robots at rest and at their waypoints. Larger: directions of slow robots lose length.
"""

SQUARED_LENGTH_FLOOR: Final = 1e-300
"""[cell^2] Least squared length of a line of sight that is divided by: avoids 0 / 0 for a robot at its goal."""

SIMILAR_VELOCITY_SPAN: Final = 5
"""[spacings] Over which the velocities of similar motions are measured.

Larger: turns are seen later. Smaller: noise of positions enters.
"""

SIMILAR_MEMORY: Final = 1000
"""[spacings] Past in which motions are searched. Larger: more work and memory. Smaller: rare motions are forgotten."""

LARGEST: Final = 1e100
"""[1] Largest magnitude of a position, velocity or acceleration (m, m/s, m/s^2): squares of them must be finite.

Larger: lengths are infinite and times not numbers. Smaller: far scenes are refused, exact or not.
"""

PATH_BRAKING: Final = 0.5
"""[1] Share of the braking with which a robot slows down for a lower speed further on along its path.

Larger: it brakes later, and has less left to avoid obstacles. Smaller: it slows down earlier.
"""

LONGEST_FORECAST: Final = 10000.0
"""[s] Length of a predicted path; it exceeds every horizon.

Smaller than a horizon: an obstacle would vanish within it.
"""

WHOLE_COUNT: Final = 1e-9
"""[1] Excess over a whole number of periods or steps that is rounding and does not count as one more.

Larger: durations are cut short by that share. Smaller than 1e-15 times the count: an additional period by rounding.
"""

ARRIVAL_FILTER: Final = 1.1
"""[1] The goal of a robot is evaluated within this many tolerances of it; farther robots have not arrived.

The array that the filter uses and the goal may round differently. It must exceed 1 by more than rounding; a larger
value changes no arrival and costs more calls.
"""

REST_ROUNDING: Final = 1e-9
"""[s] Rounding of the time from which a robot is at rest.

Larger: contacts that much before it are missed. Smaller: a segment that begins at rest counts as motion.
"""

OCCUPIED: Final = 65
"""[%] Least value of an occupied cell of an occupancy grid by default, as map servers use it.

Larger: fewer cells are obstacles. Unknown cells (-1) are decided apart.
"""
