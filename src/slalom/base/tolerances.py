"""Every numerical constant of slalom: its unit, why it has its value, what changes if it changes."""

from math import radians
from typing import Final

CONTACT: Final = 2.5e-7
"""[m] Elements are grown by this much before a choice is sought outside them.

It makes the exchange end (each new element covers a small ball around the control that it rejects) and
it absorbs rounding. A safe control that would come nearer to an obstacle than this is not found.
Larger: fewer exchanges, a choice farther from the optimum. Smaller than about 1e-9 m: rounding decides.
"""

OVERLAP: Final = 2.5e-6
"""[m] A robot that is deeper in an obstacle than this overlaps it; less deep, it touches it.

More than the sum of CONTACT and of the errors of a piece, in position and in heading, each up to INTERPOLATION. A robot
in contact after a choice may lie that deep in the piece. It must stay below CONTACT_SLACK. Larger: deeper overlaps
count as contact. Smaller: contact with an obstacle on a circle counts as overlap.
"""

SHALLOW_OVERLAP: Final = 1e-3
"""[m] Depth up to which a robot that overlaps an obstacle may still get deeper while it leaves.

Robots that follow inexactly overlap by less. Larger: others that leave no safe control press a robot deeper into walls.
Smaller: robots that overlap each other on all sides, by micrometres, block each other.
"""

DEEPEST: Final = 1.0
"""[m] A robot that gets deeper than this into an obstacle within one period, whatever it does, does not avoid it.

Larger: more choices before such a decision. Smaller: fast obstacles that press a robot push it into others.
"""

DEEPER_BY: Final = (0.001, 0.004, 0.016, 0.064, 0.256)
"""[m] By how much deeper into all obstacles a robot may get that overlaps some: the first with which it has a control.

More of them: it gets less deep, and such decisions take longer. Larger: bodies that press it may push it through walls.
"""

SAME_POSITION: Final = 1e-6
"""[m] Robots that overlap and are nearer to each other than this leave in directions by their numbers.

Larger: robots next to each other leave in directions that have nothing to do with their positions. Smaller than the
rounding of positions: robots that start at one position stay together.
"""

GOLDEN_ANGLE: Final = 2.399963229728653
"""[rad] Angle between the directions of robots that follow each other by number: no two directions are near."""

BALL_FILLED: Final = 0.4
"""[1] Share of its bounding ball that an obstacle fills if the cost of a detour around it counts that ball.

A car fills 0.44. Larger: no such costs for more obstacles. Smaller: robots beside walls stay where they are.
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

The intersection of boundaries that meet at a smaller angle depends on rounding only.
"""

LAST_DIRECTION: Final = 1e-3
"""[1] Error of the direction that a body keeps which has come to rest. Larger: it stands at a wrong angle."""

SMALLEST_EXTENT: Final = 1e-3
"""[m] Largest distance of a corner below which a body that turns counts as this large.

Larger: less exact directions of small bodies. Smaller: more pieces for bodies that are nearly points.
"""

BOUND_SHARE: Final = 1.1
"""[1] Factor on the acceleration of the cubic pieces of a manoeuvre, as a bound on its true one.

Larger: safe, and coarser. Smaller: what the pieces smooth is not bounded.
"""

BOUND_EXTRA: Final = 1e-3
"""[m/s, m/s^2] Addition to the speed and the acceleration of these pieces, as BOUND_SHARE."""

SHORTEST_HORIZON: Final = 1e-3
"""[s] Least horizon for one obstacle. Larger: obstacles beside a robot at rest count longer. At 0: for no time."""

STANDING: Final = 1e-3
"""[s] Turns of the heading within less time than this are not resolved: the body turns about on the spot.

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

LEAST_WIDTH: Final = 0.5**DEPTH
"""[1] Width of a cubic piece after that many bisections, as a share of the whole piece."""

ELEMENTS: Final = 4096
"""[1] Most elements in the working set of one choice. Reaching it is a status (UNDECIDED), never an answer."""

CANDIDATES: Final = 2_000_000
"""[1] Most candidate controls examined in one choice. Reaching it is a status (UNDECIDED), never an answer."""

FEW_ELEMENTS: Final = 64
"""[1] Most elements in the working set of a choice in a search over sequences; harder candidates are dropped."""

FEW_CANDIDATES: Final = 5_000
"""[1] Most candidate controls in such a choice. Larger: a search finds more free controls and takes longer."""

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

STALLED_SPEED: Final = 0.05
"""[m/s] Speed below which a robot is stalled in metrics, as in Francis et al. (arXiv:2306.16740).

Larger: slow robots count as stalled. Smaller: robots that drift do not.
"""

PROGRESS_DISTANCE: Final = 0.1
"""[m] A robot that approaches its goal by less than this within PROGRESS_TIME fails to progress (Francis et al.).

Larger: slow approaches are failures. Smaller: a robot that only drifts makes progress.
"""

PROGRESS_TIME: Final = 5.0
"""[s] Length of the intervals in which progress is measured (Francis et al.).

Larger: fewer intervals, short stops are forgiven. Smaller: each stop is a failure.
"""

PERSONAL_SPACE: Final = 0.5
"""[m] Clearance required for space compliance (Francis et al.). Larger: a smaller share of the steps complies."""

CLOSING_INTERVAL: Final = 1e-6
"""[s] Time step of the finite difference that gives the closing speed of bodies with corners.

Larger: the nearest corners may change within it. Smaller: rounding of the clearance enters the speed.
"""

MOVING_SHARE: Final = 0.1
"""[1] A robot moves, and has a heading, if it is faster than this share of its maximum speed.

Larger: turns at low speed are omitted. Smaller: robots that oscillate almost at rest accumulate hundreds of radians.
"""

DEPTH_RESOLUTION: Final = 1e-3
"""[s] Shortest interval in the search for the recorded penetration depth of overlapping bodies.

Larger: less depth is found. Smaller: slower metrics of runs with collisions.
"""

BLOCK_STEPS: Final = 16
"""[1] Steps of a recording that one bounding ball covers in the broad phase of the clearance between robots.

Larger: larger balls, so more steps are examined. Smaller: more balls. The clearance is the same.
"""

SYMMETRY: Final = 1e-9
"""[1] Largest difference of a measured covariance from its transpose, as a share of its largest entry.

Larger: matrices that are no covariances are taken. Smaller: rounding of the sender is refused.
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

Smaller by 4: twice as many points. It never decides about collisions.
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

COARSE_NORMALS: Final = 0.05
"""[rad] Angle between the normals of an outline outside the window of a boundary.

Larger: a far outline that crosses the window may be missed. Smaller: more points that are not drawn.
"""

MAX_ARC_POINTS: Final = 65536
"""[1] Largest number of points on such an arc within the window.

Larger: more memory where a huge radius meets a small tolerance. Smaller: the boundary there is off by more than its
tolerance.
"""

COST_TIE: Final = 1e-9
"""[s] Costs and optimistic costs that differ by less are equal: the first response is taken.

Larger: more ties. Smaller: rounding decides which response is taken.
"""

CLEARANCE_STEPS: Final = 6
"""[1] Bisections of the clearance beyond the margin, of at most `MostClearance.enough`: to 1/64 of it.

More: decisions take longer where that clearance is not free. Fewer: the clearance found is less.
"""

MIN_IMPROVEMENT: Final = 0.25
"""[1] Share of the shortest response by which an optimistic cost must be below the least cost found so far.

Other responses are not examined. Larger: fewer are, and arrivals are later by up to this. 0: all that may be better.
"""

# Selection

KEPT_ROBOT_MOTIONS: Final = 8
"""[1] Parts of a robot's own motion that are kept from one body to the next, since bodies are often cut at equal times.

Larger: longer lists are searched, most of them without a match. Smaller: the same parts are computed again.
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

CONTACT_SHARE: Final = 0.25
"""[1] Share of CONTACT by which a control in space may lie inside an element and count as outside.

Candidates are computed with rounding that grows with the distance and size of elements. Larger than 1: the element that
rejected a control does not exclude it. Much smaller: rounding excludes free controls.
"""

WORK_CURVE: Final = 30
"""[1] Work of a curve in which two boundaries in space meet, in comparisons of a control with a boundary.

Larger than its true time: choices with many elements end earlier. Smaller: they may take longer than stated.
"""

WORK_POINT: Final = 100
"""[1] Work of a candidate in space besides its comparisons with boundaries: see WORK_CURVE."""

MOST_WORK_IN_SPACE: Final = 4_000_000
"""[1] Most work of one choice in space, in comparisons of a control with a boundary or a segment: 10 to 25 ms.

Reaching it is a status (UNDECIDED), never an answer. Larger: a choice among hundreds of obstacles may take longer.
Smaller: more choices end undecided.
"""

# Decisions

ARRIVAL_ROOT: Final = 5e-10
"""[1] Relative distance from the earliest arrival at which a root found by secants is accepted.

Larger: more steps of the bisection are computed. Smaller: more roots are rejected, and all steps are computed.
"""

ARRIVAL_STEPS: Final = 6
"""[1] Most secant steps towards the earliest arrival; more than four are seldom needed.

Larger: time lost where secants do not converge. Smaller: bisection more often.
"""

ARRIVAL_SAMPLES: Final = 8
"""[1] Times at which a manoeuvre is tested for an arrival before its control has been carried out.

Larger: an arrival on the way is noticed earlier. Smaller: a robot may pass its goal unnoticed in the cost.
"""

BRAKING_SHARE: Final = 0.75
"""[1] A robot that stops at its goal approaches no faster than this share of its largest acceleration brakes.

Larger: later arrivals are avoided, but small disturbances make it overshoot. Smaller: it approaches more slowly.
"""

BALL_ROUNDING: Final = 1e-9
"""[1] Share (and [m]) by which bounding balls are larger than computed, for rounding.

Smaller than the rounding of a few operations: a robot that can be met might be left out.
"""

REACH_SHARE: Final = 1.25
"""[1] A decision knows passive bodies up to this many times the distance at the largest speed within the horizon.

Larger: more bodies are passed to each decision. Below 1: bodies that the robot can meet are left out. Just above 1: a
committed manoeuvre that disturbances displace may lead to where bodies are left out, and is not kept then.
"""

COOPERATION_RANGE: Final = 0.3
"""[1] Robots nearer to each other than this share of the sum of their radii avoid each other in full, not in part.

Larger: less use is made of reciprocity. Smaller: two robots with wrong predictions of each other touch.
"""

REST_DURATION: Final = 1e6
"""[s] How long a robot at rest is predicted to stay: longer than any run.

Larger: times lose digits. Smaller: the robot is predicted to move on within a long run.
"""

LINEAR_RESPONSE: Final = 1e-9
"""[1, m] Relative and absolute error up to which the motion under a response counts as linear in the state.

Larger: a response that is not linear is predicted wrongly. Smaller: rounding refuses a linear one.
"""

FOLLOWING_ERROR: Final = 1e-9
"""[m, m/s] A robot within this of its committed manoeuvre follows it exactly, up to rounding.

Larger: errors of execution go unnoticed up to it. Smaller: committed paths move by rounding at every decision.
"""

AIM_FIRST: Final = 0.02
"""[s] Earliest time at which a robot aims to be at a goal that it passes.

Larger: a goal just ahead is aimed at too late. Smaller: the grid of times is coarser elsewhere.
"""

AIM_LATEST: Final = 4.0
"""[1] Latest time of the aim: this many times the time to the goal at maximum speed, and the time to reach that speed.

Larger: the grid of times is coarser. Smaller: a robot that has to turn first does not aim at its goal exactly.
"""

FASTEST_SLACK: Final = 1e-6
"""[1] Share by which the time to a target at the largest speed is reduced, for rounding.

Larger: more times are tested that no control can meet. Smaller than the rounding: the earliest time may be missed.
"""

AIM_TIMES: Final = 64
"""[1] Times, in geometric progression, at which a control that reaches the goal is sought.

Larger: an earlier aim at more cost. Smaller: the aim is later than it could be.
"""

AIM_ROUNDS: Final = 12
"""[1] Rounds in which an objective in Python seeks the earliest aim, each between two times of the one before.

Larger: more time than the last digit needs. Smaller: the aim is later than it could be.
"""

AIM_STEPS: Final = 60
"""[1] Most steps of regula falsi towards the earliest aim; seldom more than ten.

Smaller: the aim is later than it could be.
"""

AIM_ROOT: Final = 1e-14
"""[1] Relative width of the bracket of the earliest aim at which its search ends.

Larger: costs that are equal in theory differ. Smaller than rounding: all steps are computed.
"""

INTERCEPTION_STEPS: Final = 4
"""[1] Iterations that find where a robot at maximum speed meets a moving goal.

Larger: exact for goals that turn quickly. Smaller: the robot moves to a place that the goal passes at another time.
"""

INTERCEPTION_WAIT: Final = 10.0
"""[s] Largest growth of the time of an interception in its first iteration: goals may outrun the robot.

Larger: the robot moves to a far future place of a goal that it cannot reach. Smaller: more iterations are needed.
"""

DIRECT_TEST_ROWS: Final = 30
"""[1] With fewer pieces a table of segments is made as quickly as the preferred control is tested alone.

Larger: the direct test is used more seldom. Results do not depend on it.
"""

MARGIN_STEPS: Final = 4
"""[1] Number of margins that are tried, each half of the one before; then the fallback decides.

Larger: a robot in a narrow gap keeps more of its margin at more cost. Smaller: it falls back earlier.
"""

FIRST_SAMPLE: Final = 0.02
"""[s] First of the sampled times between which the earliest arrival at a goal to pass is sought.

Larger: earlier arrivals are not found. Smaller: more of the samples lie where no arrival is possible.
"""

COARSE_SAMPLES: Final = 64
"""[1] Number of these times, in geometric progression.

Larger: slower aims. Smaller: two arrivals may lie between two of them, and the earlier one is missed.
"""

FINE_SAMPLES: Final = 17
"""[1] Number of evenly spaced times from the last sample without an arrival to the first one with an arrival.

They are refined once more. Larger: slower aims. Smaller: the arrival is later by a larger share of the interval.
"""

IMMEDIATE: Final = 1e-3
"""[s] Least time at which `FollowVelocity` evaluates the velocity of a response.

At 0 an acceleration has no effect on the velocity yet. Larger: the velocity is reached later. Much smaller: rounding of
the quotient enters the control.
"""

DETOURS: Final = tuple(radians(angle) for angle in (-30.0, -60.0, -90.0, 30.0, 60.0))
"""[rad] Directions of detours of robots that meet each other, from the direction to the target; first to the right.

More values: more choices per decision. Fewer: robots that block each other stop. Without those to the left: a robot
with a wall at its right stops.
"""

AGREED_SIDE: Final = 0.1
"""[1] Half the width by which a robot counts as wider on the side on which two robots do not pass, in sums of radii.

Larger: robots pass farther from each other and arrive later. Smaller: two robots that avoid towards the same side
collide.
"""

SIDE_ROUNDING: Final = 1e-18
"""[1] Square of the share of the relative velocity across the line between two robots that is a side.

Larger: robots that meet almost head-on pass on the right. Smaller: rounding decides the side.
"""

COMPARED_COLLISION: Final = 0.1
"""[1] To this part of a period the times of unavoidable collisions under two responses are compared.

Larger: a robot may choose a response that collides that much sooner. With 0.5, 4 of 1000 crossings of observed crowds
collided that do not with 0.1. Smaller: more choices where nothing is safe.
"""

LATEST_COLLISION: Final = 0.02
"""[1] To this part of a period the time of the unavoidable collision is found under the response that is chosen.

Larger: the robot collides that much sooner than it could. With 0.5, `nlvo` collided in 45 of 200 crossings of the
roundabout, with 0.1 in 21. Smaller: more choices where nothing is safe.
"""

PRIORITY_RATIO: Final = 10.0
"""[1] Largest ratio of the priorities of two robots in a fleet.

Larger: a robot may leave almost all of the avoidance to the other, and more bodies are in reach of a decision.
Smaller: less difference between robots.
"""

# Guidance and search over sequences

DIVISOR_FLOOR: Final = 1e-9
"""[m, m/s or m^2/s^2] Least length, speed or squared speed that guidance divides by.

It avoids 0 / 0 for robots at rest and at their waypoints. Larger: directions of slow robots lose length.
"""

SQUARED_LENGTH_FLOOR: Final = 1e-300
"""[cell^2] Least squared length of a line of sight that is divided by: avoids 0 / 0 for a robot at its goal."""

FLAGS_PER_WORD: Final = 8
"""[1] Flags of one byte that are tested as one word of 64 bits, so that eight discarded robots cost one comparison."""

FILTER_ROUNDING: Final = 8e-6
"""[1] Error bound of a quantity computed in single precision, as a share of its largest term.

Each number is good to 6e-8, and fewer than ten roundings add up. Larger: the early rejection passes more robots.
Below 1e-6: rounding may discard a robot that is encountered.
"""

FILTER_SLOWEST: Final = 1e-9
"""[m/s] Robots slower than this, but not at rest, always pass the early rejection: their squared speed underflows.

Larger: more robots pass. Below 1e-19 m/s squares are 0 in single precision and such a robot could be discarded.
"""

FILTER_SLACK: Final = 0.01
"""[1] Relative excess of squared distances and of times in the early rejection, for the rounding of cross terms.

Larger: more robots pass. Smaller: the absolute error bound grows as its inverse, and more slow robots pass.
"""

ENCOUNTER_DISTANCE: Final = 1.3
"""[1] Two robots encounter each other if they would come nearer than this many times the sum of their radii.

Larger: robots form traffic circles that they do not need. Smaller: near misses slow robots down (docs/design/0008).
"""

ENCOUNTER_SHARE: Final = 0.999
"""[1] Share of the path to the waypoint on which encounters count. At the waypoint itself a robot stops instead.

Larger: above 1 a robot circles around its own goal. Smaller: encounters near the waypoint are noticed later.
"""

SAME_DIRECTION_COSINE: Final = 0.7
"""[1] Robots whose directions have a larger cosine than this follow or overtake each other: no encounter.

Larger: converging robots form traffic circles. Smaller: crossing robots no longer do.
"""

CIRCLE_ROOM: Final = 1.2
"""[1] Radius of a traffic circle as a share of the radius on which its robots fit side by side (CIRCLE_SPACING).

Larger: a longer way around it. Smaller: robots block each other on it (docs/design/0008).
"""

CIRCLE_SPACING: Final = 2.2
"""[1] Length of a traffic circle per robot, as a multiple of its radius: one diameter and a tenth.

Larger: a longer way around. Below 2: robots on the circle overlap.
"""

CIRCLE_OWN_RADIUS: Final = 0.5
"""[1] Share of a robot's own radius that is added to the radius of a traffic circle fitted to others.

Larger: longer ways. Smaller: a large robot cuts into the circle of small ones.
"""

CIRCLE_DRIFT: Final = 0.05
"""[1] Share of the way to the mean position of its robots by which the centre of a traffic circle moves in one step.

It holds while the number of robots does not grow. Larger: the centre follows each robot that joins, and robots leave
too early. Smaller: the centre stays at the first encounter, beside the later ones.
"""

CIRCLE_ENTRY: Final = 2.0
"""[1] Robots within this many of their radii of a traffic circle, or on their way there, are counted on it.

Larger: robots that only pass enlarge the circle. Smaller: robots that enter are counted late.
"""

CIRCLE_ARC: Final = 1.57
"""[1] Robots count on a traffic circle if their distances from its centre differ by this many of its radii, or less.

That is a quarter of its circumference. Larger: robots that are there at other times enlarge the circle, in large crowds
without end. Smaller: robots in the same queue have different circles and meet frontally (docs/design/0008).
"""

CIRCLE_SPEED: Final = 0.1
"""[1] Share of its maximum speed above which a robot within a traffic circle is counted even if it moves outwards.

Larger: slow robots on the circle are not counted. Smaller: robots at rest within it are.
"""

CIRCLE_CENTRE: Final = 1e-6
"""[m] A robot nearer than this to the centre of a traffic circle has no tangent, and moves to its waypoint.

Larger: more robots lose their circle. Smaller: the direction of the tangent is rounding.
"""

CIRCLE_TOLERANCE: Final = 0.5
"""[m] Tolerance of targets on the tangent of a traffic circle. They move on at each step, so none is driven to.

Larger: a robot may count such a target as reached and slow down. Smaller: nothing changes.
"""

CIRCLE_PATIENCE: Final = 1.0
"""[s] A robot that has been blocked for longer leaves its traffic circle and moves to its waypoint.

Larger: robots block each other on circles for longer. Smaller: robots leave circles that would have worked.
"""

TANGENT_DISTANCE: Final = 2.0
"""[1] Least distance of a target on the tangent of a traffic circle, as a multiple of the radius of the circle.

Larger: no gain. Smaller: a robot near the circle brakes for its target.
"""

WAYPOINT_TOLERANCE: Final = 0.1
"""[1] A waypoint before the goal is reached within this share of the robot's radius.

Larger: robots rest beside waypoints that count as reached, without sight of the next one. Smaller: no gain.
"""

KEEP_RIGHT_TIME: Final = 8.0
"""[s] In a periodic world a robot passes frontal robots on the right if it encounters them within this time.

Larger: robots turn aside early, for encounters that others prevent. Smaller: they turn aside sharply.
"""

KEEP_RIGHT_COSINE: Final = 0.8
"""[1] Least cosine of the angle between a robot's direction and that from which a frontal robot approaches.

Larger: only robots straight ahead are passed on the right. Smaller: robots that cross are passed too.
"""

NARROW_COST: Final = 3.0
"""[1] Cost per length of cells whose clearance is less than the radius by no more than half a diagonal.

Such a cell may or may not be free. Larger: paths avoid passages as wide as the robot. Smaller: paths touch walls.
"""

PARKED_COST: Final = 8.0
"""[1] Cost per length of cells that are occupied by a robot at rest at its goal; a request may move it aside.

Larger: longer detours around such robots. Smaller: more requests.
"""

WALL_COST: Final = 1e4
"""[1] Cost per length of cells that are occupied by a wall: more than any detour, but finite.

A robot whose own cell counts as occupied still gets a path. Smaller: on large grids paths may lead through walls.
"""

HALF_DIAGONAL: Final = 0.7
"""[cell] Half the diagonal of a cell, rounded down: within it the clearance is hardly larger by more.

Larger: paths through cells along walls that are occupied. Smaller: ways just wide enough along a wall count as closed.
"""

LONGEST_MOVE: Final = 5.0**0.5
"""[cell] Length of a knight's move, the longest on the grid: cells within it of the known ones may be unknown."""

BUCKET_WIDTH: Final = 0.1
"""[cell] Estimated lengths of paths that the queue of a search does not distinguish.

A path may be longer than the shortest one by so much. Larger: longer paths. Smaller: more empty buckets.
"""

MAX_PATH_CELLS: Final = 4096
"""[cell] Cells of a path at most: more than a shortest path has on a grid of 400 by 400 cells without a maze.

A longer path is cut there, which leaves the next waypoint as it is.
"""

MIN_WAYPOINT_CELLS: Final = 2
"""[1] A waypoint is at least so many cells of the path ahead, even if the line of sight to it is blocked.

Larger: waypoints behind corners. Smaller: a robot in an occupied cell gets its own cell as waypoint.
"""

SIGHT_SAMPLES: Final = 2.0
"""[1/cell] Samples of a line of sight per cell. Larger: slower. Smaller: corners of walls are missed."""

SIGHT_START: Final = 1.5
"""[cell] Length at the beginning of a line of sight on which occupied cells do not count.

The cell of a robot in contact may be occupied by rounding. Larger: lines through thin walls count as free. Smaller: all
lines from robots at walls are blocked.
"""

SIGHT_CULL: Final = 1.0
"""[cell] Robots nearer to a line of sight than their radius and this are tested at its cells.

The samples are rounded to cells, at most 0.71 cells away. Larger: more tests; smaller than that: robots are missed.
"""

REQUEST_AFTER: Final = 1.5
"""[s] A robot that has been blocked for this long sends a request to the robots ahead of it.

Larger: blocked robots lose time. Smaller: requests that a short stop would make unnecessary.
"""

REQUEST_BESIDE_AFTER: Final = 10.0
"""[s] A robot that has been blocked for this long also sends requests to robots beside it.

It resolves arches of robots before a door, in which none is ahead of another. Larger: arches last longer.
Smaller: robots beside the path move aside for nothing.
"""

REQUEST_AHEAD: Final = 0.1
"""[1] Robots ahead by more than this share of the sum of radii get a request.

Larger: robots that block by their edge get none. Smaller: robots beside the path get one.
"""

REQUEST_BESIDE: Final = 0.5
"""[1] After REQUEST_BESIDE_AFTER, robots behind by less than this share of the sum of radii get a request too.

Larger: robots behind move for nothing. Smaller: arches before a door may last.
"""

REQUEST_RANGE: Final = 1.5
"""[1] Robots within this many times the sum of radii get a request.

Larger: robots that do not block move aside. Smaller: those that block at some distance do not.
"""

REQUEST_SPEED: Final = 0.3
"""[1] Robots faster than this share of their maximum speed get no request: they leave without a request.

Larger: moving robots are diverted. Smaller: robots that drift are left in the way.
"""

YIELD_DIRECTIONS: Final = 16
"""[1] Directions that are compared for moving aside. More: slower. Fewer: gaps between robots are missed."""

YIELD_DURATION: Final = 2.0
"""[s] Time for which a robot moves aside after a request, at least.

Larger: it comes back late. Smaller: it comes back before the blocked robot has moved.
"""

YIELD_EXTENSION: Final = 0.5
"""[s] Least remaining time of moving aside while the robot that sent the request is within YIELD_RANGE.

Larger: robots come back later. Smaller than a decision period: they come back in between.
"""

YIELD_RANGE: Final = 2.5
"""[1] A robot moves aside for as long as the sender of the request is nearer than this many times the sum of radii.

Larger: it comes back later. Smaller: it comes back into the path.
"""

YIELD_DISTANCE: Final = 2.5
"""[1] Distance of the point that a robot yields to, and of the space tested for it, in sums of radii.

Larger: robots move farther aside than needed. Smaller: they stay in the way.
"""

YIELD_SAMPLE: Final = 0.5
"""[cell] Distance of the samples at which the space beside a path is tested for walls.

Larger: thin walls are missed. Smaller: slower.
"""

YIELD_BACKWARD_COSINE: Final = 0.3
"""[1] Robots do not move aside in directions whose cosine with the opposite of the request exceeds this.

Larger: they approach the robot that they yield to. Smaller: fewer ways aside are found.
"""

YIELD_ASIDE: Final = 1.2
"""[1] Distance from the path, in sums of radii, beyond which moving farther aside scores no more.

Larger: robots move farther than needed. Below 1: they may stay in the path.
"""

YIELD_DISTANCE_WEIGHT: Final = 0.3
"""[1] Score of a metre of free space in a direction, relative to a metre off the path.

Larger: robots move along the path. Smaller: they move into narrow niches beside it.
"""

YIELD_BLOCKED: Final = 0.5
"""[1] A direction with less free space than this share of the sum of radii counts as blocked.

Larger: more robots inherit the request. Smaller: robots move into gaps that are too small.
"""

YIELD_INHERITANCE: Final = 0.2
"""[1] Score, in sums of radii, of a blocked direction whose blocker can inherit the request.

Larger: more robots are moved. Smaller: robots move into narrow gaps instead.
"""

YIELD_WALL_PENALTY: Final = 1.0
"""[1] Penalty, in sums of radii, of a direction that is blocked by a wall or by a robot with a request.

Larger: such directions are taken less often. Smaller: robots may try to yield into a wall.
"""

YIELD_TOLERANCE: Final = 0.1
"""[m] Tolerance of the point that a robot yields to.

Larger: it may stay in the path. Smaller: it moves on for longer.
"""

BLOCKED_SPEED: Final = 0.15
"""[1] A robot slower than this share of its maximum speed, and not at its goal, counts as blocked.

Larger: slow robots send requests. Smaller: robots that creep in a jam send none.
"""

BLOCKED_RECOVERY: Final = 2.0
"""[1] A moving robot loses its waiting time so many times faster than it gained it.

Larger: a robot in stop and go never sends requests. Smaller: it sends requests long after it has moved on.
"""

FIRST_VISIT_PRIORITY: Final = 1e6
"""[s] Added to the waiting time of robots that have never arrived: they go before those that yielded their goals.

More than any duration. Smaller: a robot that has yielded may come back before the other one has passed.
"""

# Elements of hulls

ELEMENT_SPAN: Final = 0.25
"""[1] First half width, as a share of a segment, of the span of time that one element of a hull covers.

Larger: fewer, larger elements, more of them rejected. Smaller: more elements.
"""

ELEMENT_HALVINGS: Final = 24
"""[1] How often that width is halved before the element at a single time is taken.

Larger: more work where nothing fits. Smaller: sharp corners need more elements.
"""

ELEMENT_DEPTH: Final = 0.7
"""[1] An element over a span must hold the control at least this share as deep as the element at one time.

Larger: shorter spans. Smaller: elements that reject little else.
"""

ELEMENT_RADIUS: Final = 0.25
"""[1] And at least this share of its own radius deep.

Larger: shorter spans. Smaller: elements of which the control is hardly inside.
"""

SAG_SHARE: Final = 0.25
"""[1] A sag below this share of CONTACT is taken off the radius instead of shrinking the corners.

Larger: elements are a little smaller than needed. Smaller: more corners are shrunk for nothing.
"""

ELEMENT_GAIN: Final = 1e-9
"""[1] (unit of the response) Below this gain the corners of a hull have no image in control space.

Larger: early spans have no elements. Smaller: images of corners overflow.
"""

DEEPEST_SAMPLES: Final = 8
"""[1] Intervals of a segment at whose ends the depth inside a hull is sampled before golden section.

Larger: deeper elements, at more cost each. Smaller: a deeper time may be missed, and the exchange takes longer.
"""

GOLDEN_STEPS: Final = 18
"""[1] Steps of golden section towards the deepest time: each multiplies the interval by 0.618.

Larger: time spent below rounding. Smaller: elements are less deep.
"""

NEWTON_STEPS: Final = 6
"""[1] Most steps of Newton's method towards the deepest time of a ball; it converges quadratically.

Larger: never needed. Smaller: elements are less deep, and the exchange takes longer.
"""

NEWTON_ACCURACY: Final = 1e-4
"""[1] Share of a segment below which a Newton step ends the search.

Larger: elements are less deep. Smaller: a step more that changes only rounding.
"""

POLYGON_SLACK: Final = 1e-9
"""[1] Relative slack by which arcs and edges of rounded polygons count as reaching into the admissible set.

Larger: more candidates. Smaller: rounding loses a boundary that touches the set.
"""

# Arrivals and bounding balls

ARRIVAL_FIRST: Final = 1e-3
"""[s] First of the times between which an earliest arrival is sought.

Larger: arrivals before it are rounded up. Smaller: more times.
"""

ARRIVAL_RATIO: Final = 1.05
"""[1] Ratio of successive times of that list.

Larger: two arrivals may lie in one interval. Smaller: more times.
"""

ARRIVAL_COUNT: Final = 424
"""[1] Number of these ratios: the last time is about 1e6 s.

Smaller: later arrivals count as never.
"""

SECANT_OFFSET: Final = 1e-4
"""[1] Relative offset of the second start of the secants.

Larger: a step more. Smaller: the first difference is rounding.
"""

RESPONSE_WINDOWS: Final = 48
"""[1] Windows of the horizon in which the motion under one response is bounded; a multiple of 2 BALL_WINDOWS.

Larger: fewer pieces of obstacles are tested for a response, at more cost of the bounds. Smaller: the contrary.
"""

BALL_WINDOWS: Final = 6
"""[1] Windows of the horizon, each with a bounding ball of every observed path and reachable set.

Larger: tighter balls that cost more to test. Smaller: more robots that cannot be met are examined.
"""

ELLIPSE_SIDES: Final = 32
"""[1] Sides of the inscribed polygon that replaces an ellipse; it keeps cos(pi / 32) = 0.9952 of every radius.

Larger: more half-spaces, slower choices. Smaller: the robot uses less of its friction.
"""

CONE_FACES: Final = 8
"""[1] Sides of the pyramid or prism that replaces a cone or cylinder; it keeps cos(pi / 8) = 0.924 of every radius.

Larger: more half-spaces, slower choices in space. Smaller: less of the bound is used.
"""

STRAIGHT_TURN_RATE: Final = 0.001
"""[rad/s] Obstacles that turn more slowly are predicted to move straight on.

Larger: gentle turns are ignored. Smaller: circles of enormous radius lose digits.
"""

PAST_POSITIONS: Final = 5
"""[1] Number of past positions to which `FromPast` fits its parabola.

Larger: more smoothing of noise. Smaller: noise enters the prediction.
"""

PAST_SPACING: Final = 0.1
"""[s] Spacing of the past positions of an obstacle that is not a `Sampled` trajectory, or has few samples.

Larger: short motions are smoothed. Smaller: the models see less of the past, and more rounding.
"""

SPACINGS: Final = (0.05, 10.0)
"""[s] Least and largest spacing of the past positions that motion models use.

A smaller least: the noise of fast sensors enters. A larger greatest: the models of rare samples reach further back.
"""

NEWEST_SAMPLES: Final = 30.0
"""[s] Past in which the spacing of a sampled track is measured. Smaller: slow sensors have too few samples in it."""

FEWEST_PAST: Final = 3
"""[1] Spacings of the past that motion models have at least; of a shorter past they are parts.

Larger: noise of the first positions enters. Smaller: no acceleration is fitted at first.
"""

MODEL_LEAD: Final = 8
"""[spacings] Over which motion models are compared with the past.

Larger: less of the past is left to compare with, and models that last longer weigh more. Smaller: noise counts more.
"""

MODEL_CHECKS: Final = (0, 2, 4, 6, 8, 10, 14, 18, 24)
"""[spacings] Before now, at which predictions of motion models are compared with the track.

Earlier ones: a model that was good once stays longer. Fewer: weights jump with single errors.
"""

MODEL_SHARPNESS: Final = 4.0
"""[1] Power of the past error in the weight of a motion model.

Larger: the best model alone counts. Smaller: bad models pull the mean.
"""

LEAST_FUTURE: Final = 0.02
"""[1] Least probability of a future of its own; less probable motions join the nearest one.

Larger: rare motions bend the likely ones. Smaller: more futures that hardly ever happen.
"""

PROBABILITY_SLACK: Final = 1e-9
"""[1] By how much the probabilities of the futures of one obstacle may exceed 1 together.

Larger: wrong weights pass. Smaller: rounding of right ones is refused.
"""

MODEL_PRIOR: Final = (0.1, 0.11, 0.13)
"""[1] Error of motion models before any is known, as a share of the way: of the first, other straight ones, the rest.

Larger: tracks that have just appeared get larger radii. More equal: their turns are predicted from a few positions.
"""

MODEL_KNOTS: Final = (0, 4, 8, 14, 22, 32, 45, 60)
"""[spacings] Knots of the predicted curve, after which it is straight.

Later ones: turns are predicted further, for more pieces. Fewer: the curve leaves the mean of the models.
"""

SIMILAR_PLACE: Final = 3.0
"""[spacings] Scale of the distance between similar motions: the way in this time at the present speed.

Larger: motions of other lanes count. Smaller: few earlier motions are similar.
"""

SIMILAR_VELOCITY: Final = 0.3
"""[1] Scale of the difference between velocities of similar motions, as a share of the present speed.

Larger: motions that turn elsewhere count. Smaller: few earlier motions are similar.
"""

SIMILAR_REACH: Final = 4.0
"""[1] Scales beyond which motions are not similar. Larger: weights of 0 are added. Smaller: weights jump to 0."""

SIMILAR_VELOCITY_SPAN: Final = 5
"""[spacings] Over which the velocities of similar motions are measured.

Larger: turns are seen later. Smaller: noise of positions enters.
"""

SIMILAR_DOUBT: Final = 0.5
"""[1] Weight of the present velocity beside the weights of similar motions, each at most 1.

Larger: single earlier motions count less. Smaller: one earlier motion is repeated as it was.
"""

SIMILAR_CANDIDATES: Final = 4
"""[1] Similar motions that are kept, in multiples of those that count: some end too early for later knots.

Larger: more work. Smaller: fewer count at late knots.
"""

SIMILAR_MEMORY: Final = 1000
"""[spacings] Past in which motions are searched. Larger: more work and memory. Smaller: rare motions are forgotten."""

SIMILAR_BLOCK: Final = 200
"""[spacings] Past positions that are sampled and kept together. Larger: the newest ones are sampled anew more often."""

STRETCH_HORIZONS: Final = 4.0
"""[1] Length of a stretch of time over which the pieces of an `ObstacleTable` are made at once, in horizons.

Larger: pieces take longer to make, more seldom, and more memory. Smaller: more decisions include the time to make them.
"""

LARGEST: Final = 1e100
"""[1] Largest magnitude of a position, velocity or acceleration (m, m/s, m/s^2): squares of them must be finite.

Larger: lengths are infinite and times not numbers. Smaller: far scenes are refused, exact or not.
"""

YAML_DEPTH: Final = 100
"""[1] Lists and mappings within each other in a YAML file.

Larger: the parser, whose time grows with the square of the depth, takes seconds until it refuses a file. Smaller:
files with unions of unions of shapes are refused.
"""

WORK_DECISIONS: Final = 300
"""[1] Decisions from which the counted work in a second of a computer is measured.

Larger: a more exact figure that takes longer, about 0.3 ms for each decision. Smaller: a less exact one.
"""

YAML_VALUES: Final = 1_000_000
"""[1] Values of a YAML file, those behind aliases counted wherever they stand.

Larger: a file of a few lines can take minutes and gigabytes. Smaller: large scenarios are refused.
"""

SHOWN: Final = 200
"""[1] Characters of a value that a message about a file shows.

Larger: messages flood the terminal. Smaller: a mistake may lie in the part that is not shown.
"""

MESSAGE_LINE: Final = 1000
"""[1] Characters of a line about a mistake in a file; a longer line is cut there.

Larger: messages flood the terminal. Smaller: the list of formats, or of the keys of a part, is cut.
"""

JSON_LINES: Final = 200_000
"""[B] Size of the file of a decision up to which a reader of YAML finds the lines of mistakes.

Larger: it takes seconds to refuse a large file. Smaller: messages of more files name line 1.
"""

MAX_FILE_SIZE: Final = 1_000_000_000
"""[B] Size of a file that is read. Texts are read whole, and take up to about ten times as much memory.

Larger: a wrong file takes all memory. Smaller: large recordings are refused.
"""

MAX_ROWS: Final = 10_000_000
"""[1] Rows of a recording. Each takes up to about a kilobyte of memory until it is part of a track.

Larger: a wrong file takes all memory. Smaller: large recordings are refused.
"""

ROW_BYTES: Final = 8
"""[B] Least size of a row in a database: a file that holds more rows per byte holds the same page many times.

Larger: small databases could be refused. Smaller: malformed ones of some megabytes take longer to refuse.
"""

DATABASE_VALUE: Final = 100_000
"""[B] Length of a text in a database. Larger: a generated column takes gigabytes. Smaller: long remarks are refused."""

DATABASE_STEPS: Final = 100
"""[1] Operations of SQLite per row that a file of its size may hold, and at least as many as for 10000 rows.

A row of a table takes 7.

Larger: a view or a generated column without end is refused later. Smaller: slow queries of valid files are refused.
"""

HDF5_CONTENT: Final = 50_000_000
"""[B] Content of an HDF5 file that is larger than the file: one that is compressed or has empty parts.

Larger: a file of a few kilobytes takes gigabytes. Smaller: files that other programs compressed are refused.
"""

HDF5_MEMORY: Final = 400_000_000
"""[B] Memory of the process that reads an HDF5 file, in addition to four times the size of the file.

Larger: malformed files take more memory until they are refused. Smaller: valid files are refused.
"""

HDF5_SECONDS: Final = 0.6
"""[s] Processor time to read an HDF5 file, in addition to that of HDF5_RATE.

Larger: a malformed file on which reading does not end is refused later. Smaller: slow computers refuse valid files.
"""

HDF5_RATE: Final = 1e6
"""[B/s] Least speed of reading HDF5, in processor time; many small groups are read at five times as much.

Larger: slow computers refuse valid files. Smaller: large malformed files are refused later.
"""

HDF5_WAIT: Final = 20.0
"""[1] Longest time to read an HDF5 file, as a multiple of the allowed processor time.

Larger: a file on a drive that does not answer is refused later. Smaller: a busy computer refuses valid files.
"""

HDF5_DEPTH: Final = 32
"""[1] Groups within groups of an HDF5 file. Larger: recursion may end in an error. Smaller: unions are refused."""

MAX_STEPS: Final = 10_000_000
"""[1] Steps of a scenario. Larger: a slip in dt runs for days. Smaller: long studies are refused."""

MAX_HORIZON: Final = 5000.0
"""[s] Horizons, and durations for which accelerations are held; below LONGEST_FORECAST.

Larger: predicted obstacles vanish within the horizon. Smaller: long horizons are refused.
"""

MAX_PIECES: Final = 1_000_000
"""[1] Pieces of a curve over one stretch of time.

Larger: a slip in a radius takes gigabytes. Smaller: fine curves are refused.
"""

PATH_BRAKING: Final = 0.5
"""[1] Share of the braking with which a robot slows down for a lower speed further on along its path.

Larger: it brakes later, and has less left to avoid obstacles. Smaller: it slows down earlier.
"""

PATH_SAMPLES: Final = 4
"""[1] Points of a path up to the lookahead that are examined for obstacles at rest.

Larger: decisions take longer. Smaller: thin obstacles across the path are found late.
"""

PATH_OFFSETS: Final = 20
"""[1] Points on either side of a covered path that are examined until one is free, a radius of the robot apart.

Larger: robots pass wider obstacles on their path. Smaller: decisions take less time.
"""

PATH_TOLERANCE: Final = 0.25
"""[1] Tolerance of the point ahead on a path, as a share of its distance.

Larger: robots aim less exactly. Smaller: they turn late to pass the point.
"""

APPROACH_TIME: Final = 0.1
"""[s] A robot has made progress when it is nearer to its goal by what it drives in this time at its largest speed.

Larger: slow robots count as stuck. Smaller: a robot that swings behind an obstacle may count as one that gets on.
"""

LONGEST_FORECAST: Final = 10000.0
"""[s] Length of a predicted path; it exceeds every horizon.

Smaller than a horizon: an obstacle would vanish within it.
"""

UNCERTAINTY_PIECES: Final = 8
"""[1] Straight lines that stand for a growing radius over one window.

Larger: more pieces. Smaller: the radius is larger than needed in between.
"""

WORK_NODE: Final = 8.0
"""[us] Counted for the expansion of a node of a search over sequences, without its bodies and candidates.

The counts stand for times on a usual machine (benchmarks/crossings.py compares them). Larger than the true time:
searches end earlier than their budget. Smaller: they take longer than it.
"""

WORK_ROW: Final = 0.3
"""[us] Counted for each piece of a body near a motion: see WORK_NODE."""

WORK_CANDIDATE: Final = 0.6
"""[us] Counted for the test of one candidate acceleration: see WORK_NODE."""

WORK_CHOICE: Final = 8.0
"""[us] Counted for an exact selection, and for an attempt to steer to the goal: see WORK_NODE."""

WORK_CONTROL: Final = 1.4
"""[us] Counted for the test of one control by an exact selection among the obstacles of a decision: see WORK_NODE."""

WORK_ELEMENT: Final = 10.0
"""[us] Counted for an element of such a selection where bodies have corners: see WORK_NODE."""

WORK_STRETCH: Final = 3.0
"""[us] Counted for each stretch of a motion that is tested: see WORK_NODE."""

WHOLE_COUNT: Final = 1e-9
"""[1] Excess over a whole number of periods or steps that is rounding and does not count as one more.

Larger: durations are cut short by that share. Smaller than 1e-15 times the count: an additional period by rounding.
"""

TIME_CELLS_PER_STEP: Final = 2.0
"""[1] Cells of time per step of a search over sequences; the tree keeps one node for each cell.

Larger: more nodes that are nearly the same. Smaller: nodes at different times exclude each other.
"""

CELLS_PER_STEP: Final = 4.0
"""[1] Cells of position per distance at maximum speed during one step; the tree keeps one node for each cell.

Larger: more nodes that are nearly the same. Smaller: sequences through narrow gaps are missed.
"""

CELLS_PER_MAX_SPEED: Final = 5.0
"""[1] Cells of velocity per maximum speed; the tree keeps one node for each cell.

Larger: more nodes that are nearly the same. Smaller: nodes with different velocities exclude each other.
"""

COAST_ATTEMPTS: Final = 100
"""[1] Arrival times that are tried for passing the goal after one acceleration and coasting.

More: slower where the goal is beside the course of a fast robot. Fewer: arrivals that need a later time are missed.
"""

COAST_STEP: Final = 0.25
"""[1] Share of a period between these arrival times.

Larger: later arrivals. Smaller: COAST_ATTEMPTS cover less time.
"""

BRAKE_STEPS: Final = 2.0
"""[1] Steps that accelerating, and then braking to a stop at the goal, may each take at most.

Larger: stops at distant goals are found at once, in more tests. Smaller: only from nodes near the goal.
"""

EARLIER_ARRIVAL: Final = 0.5
"""[1] Share of a period by which a new arrival must precede the best one.

Arrivals are whole periods apart, but for rounding. Larger than 1: arrivals one period earlier are missed.
"""

OVERSPEED_BRAKING: Final = 0.5
"""[1] Share of its maximum acceleration with which a robot above its maximum speed must at least brake.

Larger: fewer manoeuvres are admissible. Smaller: it stays too fast for longer. At 0 it need not brake.
"""

SPARE_NODES: Final = 8
"""[1] Nodes that are kept free, besides one for each direction, when a search is cut because its tree is full.

One expansion adds three more nodes than there are directions, and steering to the goal two. Fewer than that: the tree
overflows. More: it is cut earlier.
"""

SEARCH_SCALES: Final = (1.0, 0.5)
"""[1] Steps of a search over sequences, as multiples of the time from rest to max_speed, tried in this order.

The finer step serves if the coarser one finds no arrival. Larger: fewer nodes to the goal, narrow gaps are missed.
Smaller: the budget ends before an arrival is found.
"""

HEURISTIC_WEIGHT: Final = 2.0
"""[1] Weight of the time to go relative to the elapsed time in a search over sequences.

Larger: faster searches that find later arrivals. Smaller: more nodes; with 1 the first arrival is the earliest.
"""

SEARCH_DIRECTIONS: Final = 8
"""[1] Directions of the accelerations of a search over sequences in the plane; in space there are 26.

Larger: earlier arrivals, more exact choices per node. Smaller: ways around obstacles are missed.
"""

GOAL_TOLERANCE_SHARE: Final = 0.8
"""[1] Share of the goal's tolerance within which a sequence must arrive.

The deviations of the motion from the sequence use the rest. Larger: a robot may miss its goal by rounding. Smaller:
later arrivals.
"""

MAX_NODES: Final = 20_000
"""[1] Nodes of the tree of a search over sequences; a full tree ends the search.

Larger: a search needs more memory, about 130 bytes per node. Smaller: long searches end without an arrival.
"""

END_NODES: Final = 2
"""[1] Nodes that are kept free for the ends of sequences: a tree without more free nodes is full.

A stop at the end of a sequence takes one node. Fewer: the tree overflows. More: it is full earlier.
"""

MAX_STOP_TESTS: Final = 30
"""[1] Sequences that are tested for a stop at their end, in the order of their estimated arrival.

Larger: more time where no stop is safe. Smaller: the navigator decides although a safe sequence is known.
"""

MARGIN_SHARES: Final = (1.0, 0.5, 0.25, 0.0)
"""[1] Shares of the margin with which a search over sequences is repeated, in this order, until one succeeds.

More values: a robot in a narrow gap keeps more of its margin, for more searches. Without 0: it finds no way where only
contact is avoidable.
"""

DOUBT_SHARES: Final = (1.0, 0.5, 0.0)
"""[1] Shares of the uncertainty of obstacles with which a search over sequences is repeated until one succeeds.

More values: a robot without a certain way keeps more distance from likely positions, for more searches. Only 1: it
has no sequence where the uncertainty leaves no way.
"""

SOONER_SHARE: Final = 0.3
"""[1] Share of the uncertainty of obstacles, and of the margin, that a sequence keeps clear of to arrive much earlier.

Larger: robots wait longer in dense traffic. Smaller: more forecasts are wrong by more than the distance kept.
"""

SOONER_RISES: Final = 2.0
"""[1] Times from rest to max_speed by which such a sequence must arrive earlier.

Larger: robots wait longer for a way that is clear of all of the uncertainty. Smaller: they take more ways that are not.
"""

ANEW_BUDGETS: Final = 2.0
"""[1] Budgets of work for a search among forecasts from several models: they change with every observation, so that a
search never continues at the next decision.

Larger: earlier arrivals and fewer contacts among many obstacles, slower decisions.
"""

TABLE_HORIZONS: Final = 2.0
"""[1] Length of a table of known futures, in time horizons of the search, so that it serves many decisions.

Larger: more pieces in every table. Smaller: tables are made more often; at 1 for every decision.
"""

LOSS_TIMES: Final = 8
"""[1] Moments at which the closeness of a plan counts. More: slower decisions. Fewer: late closeness is not counted."""

LOSS_STEPS: Final = 2
"""[1] Moments in one stage: the time from rest to the maximum speed, in whole periods.

More: slower decisions for the same time ahead. Fewer: a short approach is missed.
"""

LOSS_DISCOUNT: Final = 0.6
"""[1] Weight of a stage, as a multiple of the one before. Larger: late closeness counts as much as an early one."""

DEVIATION_DIRECTIONS: Final = 16
"""[1] Directions of the velocities of a deviation in the plane.

More: slower decisions, with the square. Fewer: deviations through narrow gaps are missed.
"""

DEVIATION_GAIN: Final = 0.02
"""[s] By how much the expected loss of a deviation must be below that of the plan.

Larger: fewer changes of the motion. Smaller: deviations that gain nothing, and a new plan after each.
"""

DEVIATION_PLANS: Final = 3
"""[1] Deviations of a decision after which a plan is searched.

More: slower decisions. Fewer: a deviation that only seems to be good hides a better one.
"""

CROWD_ERROR: Final = 0.072
"""[m/s] Root mean square of the errors of predicted velocities over one period in a typical crowd.

Larger: errors count as smaller than usual, and closeness costs less. It fits the spread of an expected loss.
"""

CROWD_PRIOR: Final = 100.0
"""[1] Typical errors that count with those that were observed. More: a crowd is known later to differ."""

CROWD_LARGEST_ERROR: Final = 0.4
"""[m/s] Larger errors count as this. Larger: one sudden change outweighs many predictions."""

CROWD_SCALES: Final = (0.4, 2.0)
"""[1] Least and largest factor of the errors of a crowd. Further apart: more trust, or less, in what was observed."""

CROWD_LEAST: Final = 0.6
"""[1] Factor of the errors of an agent that was predicted exactly. Larger: more distance from steady agents."""

CROWD_DOUBLING: Final = 0.12
"""[m/s] Last error of an agent that adds 1 to its factor. Larger: less distance from agents that have just changed."""

CROWD_UNKNOWN: Final = 2.0
"""[1] Factor of the errors of an agent that was not predicted so far. Larger: more distance from new agents."""

CROWD_MEMORY: Final = 0.7
"""[1] Weight of the errors of the forecast of an agent at one observation, relative to the next.

Larger: a later change between a model and a constant velocity. Smaller: a single error changes it.
"""

CROWD_RELAXATIONS: Final = 40
"""[1] Bisections of the amount by which the half-planes of an agent are moved where they permit no velocity.

More: never needed. Fewer: a velocity that is not nearest to what is permitted.
"""

PARALLEL_LINES: Final = 1e-10
"""[1] Sine of the angle below which the borders of two half-planes do not intersect.

Larger: half-planes at a small angle count as parallel. Smaller: intersections far away, with rounding.
"""

NODE_TIME_SLACK: Final = 1e-6
"""[1] Share of a period by which a time may precede that of a node and count as equal to it.

Times of nodes are sums of periods and carry rounding. Larger: the end of an acceleration is omitted. Smaller: rounding
repeats an acceleration that has ended.
"""

# Simulator

WHOLE_PERIODS: Final = 1e-9
"""[1] A duration counts as a whole number of steps or periods if it differs from one by at most this share.

Decimal settings such as 0.3 s are no exact multiples of 0.1 s. Larger: settings that are no multiples are accepted.
Smaller: rounding refuses multiples, and braking takes one period more.
"""

IMAGES: Final = 1e-9
"""[1] Images of a periodic world are also listed up to this many periods outside the box that is searched.

Rounding then omits no image on the border of the box. Larger: more images are tested. 0: one may be missing.
"""

ARRIVAL_FILTER: Final = 1.1
"""[1] The goal of a robot is evaluated within this many tolerances of it; farther robots have not arrived.

The array that the filter uses and the goal may round differently. It must exceed 1 by more than rounding; a larger
value changes no arrival and costs more calls.
"""

ARRIVAL_ERROR: Final = 1e-9
"""[m] Error of the least distance from a goal in motion during a step.

Larger: a robot that passes at the tolerance may arrive or not within this distance. Smaller: more halvings there.
"""

ROOT_HALVINGS: Final = 53
"""[1] Bisections of a share of a step: beyond them the interval is shorter than rounding can resolve."""

ARRIVAL_LOST: Final = 2.0
"""[1] A robot at its goal no longer counts as arrived beyond this many tolerances from it.

Guidance moves robots away from their goals to let others pass. Nearer to 1: robots that move aside by a little are no
longer parked. Larger: a robot that was moved away stays there and counts as arrived.
"""

ROBOTS_PER_THREAD: Final = 20
"""[1] Fewest robots whose decisions are worth a thread, and half the fewest per round that are worth rounds.

Smaller: threads take longer to start than their robots to decide. Larger: fewer cores are used. It changes no decision.
"""

GUIDED_ROBOTS_PER_THREAD: Final = 250
"""[1] Fewest robots whose targets are worth a thread; a target takes about a tenth of the time of a decision.

Smaller: threads take longer to start than their targets to compute. Larger: fewer cores are used. It changes no target.
"""

SEARCHES_PER_THREAD: Final = 20
"""[1] Fewest robots whose searches for waypoints are worth a thread: one search takes 3 us to several ms.

Smaller: threads take longer to start than their robots to search. Larger: fewer cores are used. It changes no waypoint.
"""

WAYPOINT_INTERVAL: Final = 5
"""[decisions] From one search for the waypoint of a robot to the next; each robot searches at another decision.

Larger: cheaper steps, later reactions to robots that have parked in the way. Smaller: more searches per step.
"""

GRID_CELL: Final = 0.7
"""[1] Width of the cells of the grid of waypoints, as a share of the smallest robot's radius.

Larger: passages that a robot fits through are closed. Smaller: more cells, slower searches.
"""

GRID_CELLS: Final = 400
"""[1] Most cells along a side of that grid: a larger scene has wider cells.

Larger: finer grids of large scenes, with a memory and a time of search that grow with the square.
"""

GRID_BORDER: Final = 4.0
"""[1] Width of the border around all robots, goals and obstacles at rest in that grid, in largest radii.

Smaller: no cells for a path around an obstacle at the edge of the scene. Larger: more cells that no path uses.
"""

PARKED_SPEED: Final = 0.05
"""[m/s] A robot at its goal that is slower than this is parked: waypoints lead around it.

Larger: robots that still brake are obstacles of the search. Smaller: a robot that drifts at its goal blocks others.
"""

TABLE_SPEED: Final = 100.0
"""[m/s] The tables of responses whose motion is not cubic are within INTERPOLATION up to this speed.

Larger: more pieces in every table. Smaller: the motion of faster robots is less exact than the clearance assumes.
"""

STOP_DEPTH: Final = 1e-3
"""[m] How deep in an obstacle an observed robot is predicted to stop, at most; deeper if it gets there in one period.

Larger: stops are predicted later. Smaller: a robot that moves along a wall may be predicted to stop by rounding.
"""

FORECAST_HORIZONS: Final = 10.0
"""[1] Duration of the tables of predicted robots, in horizons. Older observations are predicted one by one.

Larger: tables of forecasts that are not polynomials have more pieces. Smaller: late sensing is slower.
"""

FRESH: Final = 3.0
"""[1] A robot never waits for a message newer than one that is no older than this many times the largest delay.

Larger: pairs count as far only at larger distances, so more pairs need their right. Smaller: a robot waits more often
after lost messages. It has no part in safety.
"""

MAX_TRIES: Final = 10_000
"""[1] Rejected positions in a row after which an area of random positions counts as full.

Larger: slower refusals. Smaller: areas are refused with less than about half their area covered.
"""

MITRE_LIMIT: Final = 100.0
"""[1] Largest mitre of the outline of a rounded corner for methods of other projects, in radii.

Larger: long spikes at sharp corners. Smaller: the outline of a sharp corner no longer contains the shape.
"""

# Recordings of other formats

LONG_GAP: Final = 3.0
"""[1] A gap in a track without a split there is noted if it is longer than this many times the median step.

Larger: fewer notes. Smaller: a note for each missing sample.
"""

STAMP_ROUNDING: Final = 1e-6
"""[s] By how much time stamps may be rounded: steps that exceed a limit by less do not exceed it.

Larger: gaps that are too long are kept. Smaller: rounding splits a track.
"""

FRAME_ROUNDING: Final = 1e-6
"""[1] Largest distance of a time from its frame, in frames, for formats that number frames.

Larger: times are changed by up to this when written. Smaller: rounding refuses tracks at whole frames.
"""

# Vehicles

GOAL_HEADING_BLEND: Final = 0.25
"""[1] Distance from its goal, in tolerances of the goal, at which a vehicle keeps its heading rather than turns to it.

Larger: an axle beside its goal is left there. Smaller: the vehicle turns on the spot for errors that do not matter.
"""

POINT_TOLERANCE: Final = 0.5
"""[1] Tolerance of the goal of the point ahead of the axle, in tolerances of the goal of the axle.

The rest is left for the heading at the goal. Larger: the axle may stop short of its tolerance. Smaller: slower
arrivals.
"""

TURN_STEPS: Final = 20
"""[1] Most steps of Newton's method for the turn in a period. It converges in 3 to 5.

Larger: never needed. Smaller: the velocity at the end of a period is not the commanded one.
"""

GROWTHS: Final = (0.0, 0.5, 1.0)
"""[1] Growths of the robot in the plans of a vehicle, in distances of the point from the axle.

With 0 the body is where the point is, with 1 it is anywhere around it. More: more decisions, better ones in narrow
places. Fewer: the vehicle keeps its plan more often.
"""

TURN_RESERVES: Final = (0.0, 0.01)
"""[rad] Changes of the heading that plans for the body at its present heading allow for.

Larger: gaps are missed. Smaller: plans are rejected because the body turns.
"""

TRACKING_RESERVE: Final = 0.1
"""[1] What the plans of a vehicle keep beyond its margin, in tracking errors.

A plan that keeps exactly the margin is rejected if its vehicle is a little off. 0: most plans are rejected. Larger:
gaps are missed; 1 is the bound of the error within a period.
"""

STEERING_CONE: Final = 1.2
"""[rad] Largest angle by which a decision for a bicycle turns its course.

Larger: manoeuvres that the steering does not follow are chosen. Smaller: slower avoidance.
"""

CREEPING: Final = 1e-3
"""[m/s] A bicycle that is to be slower than this keeps its steering angle.

Larger: it leaves the place where it stops with the wrong course. Much smaller: rounding of the velocity steers.
"""

REVERSALS: Final = (3.0, 2.0, 1.0)
"""[1] Distances in turning radii by which a bicycle leaves a place backwards; the first free one is taken.

Longer: more room for the next turn, and more that is driven twice. Shorter: it may need several reversals.
"""

STEEPEST_COURSE: Final = 1.4
"""[rad] Largest angle between the heading of a bicycle and the velocity that its steering aims at, below pi / 2.

Larger: steering angles close to a right angle. Smaller: a very long steered point ahead of the front axle is not used.
"""

QUADRATURE_STAGES: Final = 5
"""[1] Nodes of Gauss quadrature for the motion in a period; its error is of the order 10, far below a micrometre.

More: slower plans of vehicles. Fewer: the motion is less exact than the pieces that stand for it.
"""

FEEDBACK_SHARE: Final = 0.5
"""[1] Largest share of the acceleration of a vehicle, and of its speed, that the correction of errors may take.

Larger: faster vehicles with slower reactions. Smaller: in long periods vehicles are slower.
"""

SPEED_STEP: Final = 0.98
"""[1] Ratio of successive speeds among which the largest permitted one of a vehicle is found.

Closer to 1: a speed that is up to 2 % larger.
"""

CIRCLE_SLACK: Final = 1.1
"""[1] Circle on which a bicycle turns towards a goal far to its side, in circles of its smallest turning radius.

Larger: wider turns. With 1 the goal may slip into the circle, and the turn begins anew.
"""

STEEPEST_BEARING: Final = 1.0
"""[rad] Angle between the course of a bicycle and its goal beyond which it first turns along a circle.

Larger: accelerations towards the goal that slow it down before it turns. Smaller: wider turns.
"""

# Live views

VIEW_GRID: Final = 61
"""[1] Grid points along each axis on which the renderer colours times to collision, inside exact outlines.

Larger: finer shades, and more time for each obstacle that is dragged. Smaller: coarser shades.
"""

VIEW_SLICE_GRID: Final = 121
"""[1] Grid points along each axis of a slice of the control space of a robot in space, whose outline they determine.

Larger: a finer outline and more time. Smaller: a coarser outline.
"""

VIEW_PROJECTION_GRID: Final = 33
"""[1] Grid points along each axis of the projections of the control space of a robot in space.

Larger: finer projections, and time that grows with the cube. Smaller: narrow free parts may be missed in them.
"""

VIEW_SILHOUETTE: Final = 800
"""[1] Directions in which the border of an admissible set in space is sought, whose hull is drawn as its projection.

Larger: a smoother outline. Smaller: an outline with visible corners.
"""

VIEW_CONTEXTS: Final = 24
"""[1] States and responses of which a view keeps control obstacles of single obstacles.

Larger: more memory, about 30 kB for each obstacle of each. Smaller: more is computed again after a change of response.
"""

VIEW_SAMPLES: Final = 33
"""[1] Times at which a view samples predicted paths over the horizon.

Larger: smoother curves and larger files. Smaller: corners become visible in curved paths.
"""

VIEW_PREDICTED: Final = 60
"""[1] Most obstacles and robots whose predicted paths a view shows, the nearest ones.

Larger: larger files and slower drawing. Smaller: fewer predicted paths in crowds; the control obstacle counts all.
"""

VIEW_BINDING: Final = 0.02
"""[m] A chosen manoeuvre is said to pass an obstacle closely up to this clearance beyond the margin.

Larger: more obstacles are named as reasons of a choice. Smaller: one that limits the choice may be left out.
"""

VIEW_APPROACH_SAMPLES: Final = 241
"""[1] Times at which the closest approach of a manoeuvre to an obstacle is sought, for a sentence of a view.

Larger: a more exact time in the sentence. Smaller: a less exact one.
"""

VIEW_EXPORT_INTERVAL: Final = 0.5
"""[s] Longest time between two control spaces of an exported run.

Larger: smaller files that show fewer decisions. Smaller: larger files.
"""

VIEW_EXPORTED: Final = 150
"""[1] Control spaces of an exported run, up to the rate of its decisions; more where VIEW_EXPORT_INTERVAL requires it.

Larger: larger files, about 6 kB for each among 30 obstacles. Smaller: longer steps between them in short runs.
"""

CONFORMAL_ERRORS: Final = 1000
"""[1] Newest errors of predictions whose quantile is a calibrated radius.

Larger: a steadier radius. Smaller: it follows a change of the motion sooner.
"""

CONFORMAL_FEW: Final = 10.0
"""[1] Independent errors below which the errors at shorter prediction times bound those at longer ones.

Larger: radii stay too large for longer. Smaller: the first predictions over a long time have too small a radius.
"""

CONFORMAL_RATE: Final = 0.002
"""[1] Change of the level of that quantile for each error.

Larger: the share of errors within the radius returns sooner to the stated confidence. Smaller: a steadier radius.
"""

FIT_SLACK: Final = 1e-12
"""[1] Share of the largest radius by which an enclosing bound may be too large; above the rounding of its equations.

Larger: a larger bound. Smaller: rounding may leave no corner of the linear programme.
"""

# Environments of gymnasium and PettingZoo

GYM_BLOCK: Final = 64
"""[1] Steps for which the motion of obstacles is computed at once, for each world.

Larger: more memory, about 1 kB for each obstacle and 16 steps, and more work for episodes that end early. Smaller:
slower steps.
"""

INTERVENTION: Final = 1e-6
"""[1] A filter has intervened if it changes an acceleration by more than this, in units of the largest one.

Larger: small changes count as none. Smaller: rounding counts as an intervention.
"""

# Messages of ROS 2

QUATERNION: Final = 1e-3
"""[1] Largest difference from 1 of the length of a quaternion in a message; it is then normalised.

More than rounding to float32 over many products. Larger: quaternions that were never set pass as rotations.
"""

UPRIGHT: Final = 1.0 - 1e-6
"""[1] Least cosine of the tilt of a box or cylinder whose footprint counts as the one it has upright (0.08 degrees).

More tilted ones count as the disc about all of them. Smaller: the footprint of a high box is underestimated.
"""

OCCUPIED: Final = 65
"""[%] Least value of an occupied cell of an occupancy grid by default, as map servers use it.

Larger: fewer cells are obstacles. Unknown cells (-1) are decided apart.
"""

GRID_NOTCH: Final = 1.5
"""[cell] Depth up to which notches of an occupied region are filled, at which its outline has fewer corners.

The outline of a straight wall of any slope has steps of less than sqrt(2) cells; they become one edge. Larger: fewer,
coarser obstacles. 0: outlines as they are, with many times as many obstacles.
"""

EARLY_DECISION: Final = 0.9
"""[1] Least time since the last decision, as a share of the period, after which odometry leads to the next one.

Odometry comes with jitter: at 1, a message that is early by a microsecond costs a whole period. Smaller: decisions come
more often than once a period, if odometry does.
"""

# At rest, and sight

AT_REST: Final = 1e-6
"""[m/s] Speed below which a robot is at rest: contacts with obstacles of `contact_at_rest` False do not count then.

Larger: a robot that still creeps counts as one at rest. Smaller: rounding hides that it is.
"""

LINE_ROUNDING: Final = 1e-13
"""[1] Rounding of a motion along a line, relative to its largest coordinate.

Larger: a curve counts as a line, and obstacles at rest are missed by that much. Smaller: rounding hides a line, and
each of its pieces makes a segment of its own.
"""

REST_ROUNDING: Final = 1e-9
"""[s] Rounding of the time from which a robot is at rest.

Larger: contacts that much before it are missed. Smaller: a segment that begins at rest counts as motion.
"""

SIGHT_LINES: Final = 16
"""[1] Straight edges in a quarter of a circle: of the range of sight, and of round bodies that hide others.

Visible regions are inside the true ones, by at most 0.5 (pi / 4 / SIGHT_LINES)^2 of the radius. Larger: closer, slower.
"""

SIGHT_ERROR: Final = 1e-3
"""[m] Tolerance to which the outline of the region that holds nothing hidden is simplified at each decision.

Hidden obstacles are larger by as much. Larger: fewer, coarser edges. Smaller: more edges, slower decisions.
"""

SIGHT_SEAM: Final = 5e-3
"""[m] Distance from walls within which an edge of that region lies on the wall, so that nothing comes through it.

Larger: gaps of that width next to walls count as closed. Smaller: walls let hidden obstacles through.
"""

SIGHT_FAR: Final = 1e4
"""[1] Length of the shadows of obstacles, as a multiple of the range of sight.

Larger: rounding of their corners. Smaller: the end of the shadow of a long wall close by lies within the range.
"""

# The command line

ESTIMATE_AFTER: Final = 3.0
"""[s] Time after the first report of progress at which the command line estimates the rest.

Larger: a better estimate. Smaller: an earlier one.
"""

LONG_COMMAND: Final = 30.0
"""[s] Least remaining time of a command that the command line prints.

Larger: fewer commands print it. Smaller: short commands print it too.
"""

METRIC_SPEED: Final = 1e-9
"""[m/s] Slowest speed with a direction, and slowest approach to an obstacle that counts, in the metrics of a run.

Larger: slow motion counts as rest. Smaller: rounding has a direction.
"""

SHORTEST_PIECE: Final = 1e-9
"""[s] Shortest cubic piece that stands in a file for a trajectory of a kind that files do not have.

Larger: a trajectory that ends at once lasts longer. Smaller: rounding of large times leaves no duration.
"""

NO_SPREAD: Final = 1e-100
"""[m] In place of no spread of the errors of a forecast. A gap divided by it has a finite square.

Larger: contacts are expected at a small distance from what is certain. Smaller: the square overflows.
"""
