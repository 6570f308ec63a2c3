"""Every numerical constant of slalom: its unit, why it has its value, what changes if it changes."""

from typing import Final

CONTACT: Final = 2.5e-7
"""[m] Elements are grown by this much before a choice is sought outside them.

It makes the exchange end (each new element covers a small ball around the control that it rejects) and
it absorbs rounding. A safe control that would come nearer to an obstacle than this is not found;
an initial clearance between -CONTACT and +CONTACT counts as touching, not as overlapping.
Larger: fewer exchanges, a choice farther from the optimum. Smaller than about 1e-9 m: rounding decides.
"""

CONTACT_SLACK: Final = 5e-6
"""[m] A robot nearer than this to an obstacle touches it: the obstacle is taken as smaller by up to this much.

More than the sum of CONTACT and CERTIFIED, so that a robot in contact may still move away although radii
are grown by those. Larger: contact is forgiven earlier; smaller: a robot in contact finds every control blocked.
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

Larger: faster, vaguer reports. Smaller: what slides along a wall takes longer. It must stay well below CONTACT.
"""

TIME: Final = 1e-9
"""[1] Width, as a share of one cubic piece, to which the time of a first contact is bracketed."""

ADMISSIBLE: Final = 1e-9
"""[1] Relative excess over a limit that counts as obeying it (rounding of projections and intersections)."""

ELEMENT: Final = 1e-12
"""[1] Relative depth inside an element that counts as lying on its boundary.

Candidates are intersections of element boundaries and carry rounding of this order. Times the distances met
(up to kilometres) it stays below CONTACT, so no collision hides in it.
"""

UNIT: Final = 1e-14
"""[1] By how much the length of a unit vector may differ from 1: such a vector is kept to the bit when read back."""

PARALLEL: Final = 1e-12
"""[1] Sine of the angle below which two planes count as parallel, and relative distance from a circle's axis.

Boundaries that meet at a smaller angle have no intersection that rounding would not move anywhere.
"""

STANDING: Final = 1e-3
"""[s] Within less than this a heading that follows the motion is not resolved: the body turns about on the spot.

For that long it counts as the disc about its position that holds it. Smaller: more pieces where speed vanishes.
"""

LOOK_BACK: Final = 600.0
"""[s] How long ago an obstacle at rest may have moved last for its heading to be known from that motion."""

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

FEW_ELEMENTS: Final = 64
"""[1] Most elements in the working set of a choice in a search over sequences; a wish that needs more is dropped."""

FEW_CANDIDATES: Final = 5_000
"""[1] Most candidate controls in such a choice. Larger: a search finds more of what is there, and takes longer."""

SMALLEST_GAIN: Final = 1e-14
"""Control obstacles start where the gain exceeds this (unit of the response: s, s^2, s^3).

Below it the control has no effect yet: a collision there is an overlap at the start, which is a status of its own.
"""

COLLISION: Final = 1e-3
"""[m] A recorded collision is a clearance below minus this. It separates contact from overlap in metrics."""

METRIC: Final = 1e-4
"""[m] Accuracy of recorded least clearances. Smaller: slower metrics; must stay below COLLISION."""

ADJUSTMENT: Final = 0.05
"""[m/s^2] Change of the applied acceleration from one step to the next that counts as an adjustment.

The paper counts adjustments without naming a threshold; 0.05 is the value of published comparisons.
"""

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

BOUNDARY: Final = 2.5e-5
"""[1] How far the drawn boundary of a control obstacle may be off, as a share of the radius of the window.

Smaller by 4: twice as many points. What collides is never decided by it.
"""

GRID: Final = 1e-3
"""[1] The grid on which curves of a boundary meet, as a share of its tolerance.

Larger: corners move by as much. Smaller: below the rounding of a crossing, faces stay open and are lost.
"""

STILL: Final = 0.1
"""[1] An element that moves less than this share of a boundary's tolerance stands: its outline is an arc there.

Larger: corners of the boundary are off by as much. Smaller: more points where an envelope begins, ends or bends
sharply.
"""

COST_TIE: Final = 1e-9
"""[s] Arrivals and promises of arrivals that differ by less are the same: the first response is taken.

Larger: more are. Smaller: which one is taken is a matter of rounding.
"""

MIN_IMPROVEMENT: Final = 0.2
"""[1] What a response must promise to be better by than the best one found, as a share of `patience`, to be looked at.

Larger: fewer are, and arrivals are later by up to this. 0: all that promise to be better.
"""

# Selection

KEPT_ROBOT_MOTIONS: Final = 8
"""[1] Parts of a robot's own motion that are kept from one body to the next, since bodies are often cut at equal times.

Larger: longer lists are searched, most of them in vain. Smaller: the same parts are computed again.
"""

CULLING_FACTOR: Final = 1.3
"""[1] Segments are copied on which controls within this many times the candidate's distance may collide.

Smaller: fewer segments are copied and tested, and copying happens more often. Results do not depend on it.
"""

CULLING_SHARE: Final = 0.06
"""[1] To that radius this share of the distance of the farthest admissible control is added.

Smaller: as for CULLING_FACTOR, for candidates near the centre. Results do not depend on it.
"""

SQUARED_DISTANCE_SLACK: Final = 1e-7
"""[1] Share by which a squared distance may be too small by rounding, as that of a nearly tangent intersection.

Larger: more candidates that were rejected already are examined again. Smaller: rounding loses a candidate.
"""

# Decisions

ARRIVAL_ROOT: Final = 5e-10
"""[1] Relative distance from the earliest arrival at which a root found by secants is believed.

Larger: more steps of the bisection are computed. Smaller: more roots are not believed, and all steps are computed.
"""

ARRIVAL_STEPS: Final = 6
"""[1] Most secant steps towards the earliest arrival; more than four are seldom needed.

Larger: time lost where secants do not converge. Smaller: bisection more often.
"""

ARRIVAL_SAMPLES: Final = 8
"""[1] Times at which a manoeuvre is tested for an arrival before its control has been carried out.

Larger: an arrival on the way is noticed earlier. Smaller: a robot may pass its goal unnoticed in the cost.
"""

BRAKING_SHARE: Final = 0.7
"""[1] A robot that stops at its goal approaches no faster than this share of its largest acceleration brakes.

Larger: later arrivals are avoided, but small disturbances make it overshoot. Smaller: it approaches more slowly.
"""

BALL_ROUNDING: Final = 1e-9
"""[1] Share (and [m]) by which bounding balls are larger than computed, for rounding.

Smaller than the rounding of a few operations: a robot that can be met might be left out.
"""

COOPERATION_RANGE: Final = 0.3
"""[1] Robots nearer to each other than this share of the sum of their radii avoid each other in full, not in part.

Larger: less use is made of reciprocity. Smaller: two robots that misjudge each other touch.
"""

REST_DURATION: Final = 1e6
"""[s] How long a robot at rest is predicted to stay: longer than any run.

Larger: times lose digits. Smaller: a long run would see it move on.
"""

DIRECT_TEST_ROWS: Final = 30
"""[1] With fewer pieces a table of segments is made as quickly as the preferred control is tested alone.

Larger: the direct test is used more seldom. Results do not depend on it.
"""

MARGIN_STEPS: Final = 4
"""[1] Number of margins that are tried, each half of the one before; then the fallback decides.

Larger: a robot in a narrow gap keeps more of its margin at more cost. Smaller: it falls back earlier.
"""
