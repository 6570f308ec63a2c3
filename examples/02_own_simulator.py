"""slalom in an existing simulator: three lines per step."""

import numpy as np

import slalom

navigator = slalom.Navigator(
    slalom.method("nao"), slalom.Disc(0.4), slalom.Limits(max_speed=2.0, max_acceleration=1.5), period=0.1, margin=0.1
)
goal = slalom.Goal(slalom.Stationary((12.0, 0.0)), tolerance=0.3, stop=True)
crowd = [
    slalom.Obstacle(slalom.Disc(0.4), slalom.ConstantVelocity((6.0, y), (0.0, -np.sign(y)), at=0.0))
    for y in (-6.0, -4.0, 5.0, 8.0)
]

position, velocity, acceleration = np.zeros(2), np.zeros(2), np.zeros(2)
decision, time, dt = None, 0.0, 0.1
while time < 30.0 and not goal.reached(position, velocity, time):
    state = slalom.State(position, velocity, acceleration)
    decision = navigator.decide(state, crowd, goal, now=time, previous=decision)
    acceleration = decision.manoeuvre.mean_acceleration(time, dt)
    # The rest is the step of your simulator; this one is a double integrator.
    position, velocity = position + dt * velocity + 0.5 * dt * dt * acceleration, velocity + dt * acceleration
    time += dt
print(f"arrived at {position.round(2)} after {time:.1f} s, last decision: {decision.outcome.value}")
