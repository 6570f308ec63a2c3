"""One decision among three cars: the accelerations that collide, and the selected one."""

import slalom

me = slalom.State(position=(-26, 0), velocity=(5, 0))
cars = [
    slalom.Obstacle(slalom.Disc(1.0), slalom.Circular(center=(0, 0), radius=r, speed=v, phase=phase), f"lane {r} m")
    for r, v, phase in ((12, 5.0, 2.2), (16, 6.5, 2.6), (20, 8.0, 2.8))
]
response = slalom.AccelerateThenCoast(hold=1.0)
blocked = slalom.control_obstacle(response, me, cars, slalom.Disc(1.0), horizon=6.0, margin=0.1)

limits = slalom.Limits(max_speed=8.0, max_acceleration=4.0)
admissible = limits.admissible(response, me, horizon=6.0)

preferred = (2.0, 0.0)
choice = slalom.select(preferred, admissible, blocked)
print("preferred:", preferred, "collides after", f"{float(blocked.time_to_collision(preferred)):.2f} s")
print("selected: ", choice.control, choice.status.value)
