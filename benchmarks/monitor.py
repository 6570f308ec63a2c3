"""Time that the view of a program takes from its loop: `slalom.live.attach` with an open page, and without a view.

usage: python benchmarks/monitor.py [--seconds 20] [--rounds 3] [--pause 0]

A robot decides among 30 cars again and again, without a pause or with one [s] after each decision. A client reads all
messages of the view in another process, as a browser does. Rounds with and without the view alternate. The share of the
view is the processor time of all threads but that of the loop, divided by the time of the round: it does not depend on
other programs of the machine. The decisions per second do.
"""

import argparse
import asyncio
import subprocess
import sys
import time
from statistics import median

import websockets

import slalom
from slalom.sim import gallery, simulate


async def read(address: str) -> None:
    """Read the messages of a page, until the server closes the connection."""
    origin, _, query = address.partition("/?")
    url = f"{origin.replace('http', 'ws')}/messages?{query}"
    async with websockets.connect(url, origin=origin, max_size=None) as connection:
        print(0, flush=True)
        async for _ in connection:
            pass


def decisions(seconds: float, pause: float, show: object = None) -> tuple[float, float]:
    """Decisions per second of a loop of this time [s], and the processor time of other threads as a share of it [%]."""
    scenario = gallery.build("roundabout_crossing", seed=3)
    navigator, states = scenario.navigator(slalom.method("nao")), simulate(scenario, "nao", seed=3)
    count, begun, decision = 0, time.perf_counter(), None
    others = time.process_time() - time.thread_time()
    while time.perf_counter() - begun < seconds:
        k = count % len(states.accelerations)
        state = slalom.State(states.positions[k, 0], states.velocities[k, 0])
        previous = decision if k else None
        now = float(states.times[k])
        decision = navigator.decide(state, scenario.obstacles, scenario.robot.goal, now=now, previous=previous)
        if show is not None:
            show(decision)
        time.sleep(pause)
        count += 1
    took = time.perf_counter() - begun
    return count / took, 100.0 * (time.process_time() - time.thread_time() - others) / took


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--pause", type=float, default=0.0)
    parser.add_argument("--read")
    given = parser.parse_args()
    if given.read:
        asyncio.run(read(given.read))
        return
    decisions(1.0, 0.0)
    alone, viewed, shares, pictures = [], [], [], []
    for _ in range(given.rounds):
        alone.append(decisions(given.seconds, given.pause)[0])
        with slalom.live.attach() as monitor:
            command = [sys.executable, __file__, "--read", monitor.address]
            client = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            client.stdout.readline()
            decisions(3.0, given.pause, monitor.show)  # the view loads its kernels
            drawn = monitor.drawn
            rate, share = decisions(given.seconds, given.pause, monitor.show)
            viewed.append(rate)
            shares.append(share)
            pictures.append((monitor.drawn - drawn) / given.seconds)
            client.kill()
    print(f"decisions per second: alone {median(alone):.1f}, with the view {median(viewed):.1f}")
    print(f"processor time of the view: {median(shares):.1f} % (rounds: {', '.join(f'{x:.1f}' for x in shares)})")
    print(f"pictures per second: {median(pictures):.1f}")


if __name__ == "__main__":
    main()
