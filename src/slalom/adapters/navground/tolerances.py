"""Numerical constants of the adapter for navground."""

RAMP = 0.3
"""[s] in which an agent reaches its speed, unless its acceleration is given. Larger: slower reactions. Smaller: fleets
that only observe each other keep wider margins."""
LEAD_SHARE = 0.1
"""[1] Distance of the controlled point ahead of the axle as a share of the distance of the wheels. Larger: the point
moves sideways at a larger speed, and the body is grown by more."""
OVERSPEED = 1.1
"""[1] Planned speeds of wheels as a share of those permitted. Larger: plans turn more at once, and the body is grown by
the part that wheels do not follow. 1: they follow all plans."""
ARC_RESERVE = 1.005
"""[1] Speeds of wheels on an arc as a share of those of the straight displacement to the same end. Smaller: wheels
would not follow some displacements exactly. The largest share found is 1.0048, for points 0.1 of the track ahead."""
HOLDS = (0.2, 0.5)
"""[s] Hold times of manoeuvres. Agents of a fleet decide often, so two hold times are sufficient."""
AT_REST = 1e-3
"""[m/s] An agent slower than this turns on the spot. Larger: it turns while it still brakes."""
