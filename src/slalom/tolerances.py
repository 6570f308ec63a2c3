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

ARRIVAL_LOST: Final = 2.0
"""[1] A robot at its goal no longer counts as arrived beyond this many tolerances from it.

Guidance moves robots away from their goals to let others pass. Nearer to 1: robots that give way by a little are no
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

Smaller: no room to pass around an obstacle at the edge of the scene. Larger: more cells that no path uses.
"""

PARKED_SPEED: Final = 0.05
"""[m/s] A robot at its goal that is slower than this is parked: waypoints lead around it.

Larger: robots that still brake are obstacles of the search. Smaller: a robot that drifts at its goal blocks others.
"""

TABLE_SPEED: Final = 100.0
"""[m/s] The tables of responses whose motion is not cubic are within INTERPOLATION up to this speed.

Larger: more pieces in every table. Smaller: the motion of faster robots is less exact than the clearance assumes.
"""

FORECAST_HORIZONS: Final = 10.0
"""[1] Duration of the tables of predicted robots, in horizons. Older observations are predicted one by one.

Larger: tables of forecasts that are not polynomials have more pieces. Smaller: late sensing is slower.
"""

FRESH: Final = 3.0
"""[1] A message no older than this many times the largest delay never makes a robot wait for a newer one.

Larger: pairs count as far only at larger distances, so more pairs need their right. Smaller: a robot waits more often
after lost messages. It has no part in safety.
"""
