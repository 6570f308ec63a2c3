"""Environments of gymnasium and PettingZoo, judged by the checks of these packages and by independent distances."""

import subprocess
import sys
import warnings

import numpy as np
import pytest

from slalom import Capsule, Disc, Goal, InvalidInput, Limits, Obstacle, Polyline, State, Stationary
from slalom.model.trajectory import Circular, Sampled
from slalom.sim import gallery, metrics, record
from slalom.sim.gallery import GALLERY
from slalom.sim.scenario import Robot, Scenario
from slalom.sim.shape_distance import clearances

gymnasium = pytest.importorskip("gymnasium", reason="the package gymnasium is not installed")
pytest.importorskip("pettingzoo", reason="the package PettingZoo is not installed")
from gymnasium.utils.env_checker import check_env  # noqa: E402
from pettingzoo.test import parallel_api_test, parallel_seed_test  # noqa: E402

from slalom.adapters.gym import (  # noqa: E402
    SINGLE,
    FleetEnv,
    FleetSafetyFilter,
    RobotEnv,
    RobotsEnv,
    SafetyFilter,
    VectorSafetyFilter,
)

FLEETS = ("ring", "corridor_swap")
SEED = "scenario_seed"


def towards_goal(observation, noise=0.0):
    """The action of a policy that sees no obstacle."""
    return observation[2:4] / max(np.linalg.norm(observation[2:4]), 1e-9) + noise


def test_every_scenario_of_one_robot_is_registered():
    built = {name: gallery.build(name) for name in GALLERY}
    assert {name for name, one in built.items() if len(one.robots) == 1 and one.sight is None} == set(SINGLE)
    for name in SINGLE:
        assert gymnasium.make(f"slalom/{name}-v0").unwrapped.worlds.scenarios[0].name == name


def test_gymnasium_finds_environments_without_an_import_of_slalom():
    code = "import gymnasium; print(gymnasium.make('slalom.adapters.gym:slalom/empty-v0').reset(seed=0)[1])"
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (made.stdout.strip(), made.returncode) == ("{'time': 0.0}", 0), made.stderr


@pytest.mark.parametrize("name", ["roundabout_crossing", "drones_crossing", "corridor"])
@pytest.mark.parametrize("command", ["acceleration", "velocity", "unicycle", "discrete"])
def test_gymnasium_finds_no_fault(name, command):
    if name == "drones_crossing" and command in ("unicycle", "discrete"):
        pytest.skip("only in the plane")
    env = gymnasium.make(f"slalom/{name}-v0", command=command).unwrapped
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env)


@pytest.mark.parametrize("name", FLEETS)
def test_petting_zoo_finds_no_fault(name):
    parallel_api_test(FleetEnv(name), num_cycles=30)
    parallel_seed_test(lambda: FleetEnv(name), num_cycles=5)


@pytest.mark.parametrize("scenario", ["drones_crossing", "recorded_roundabout", "corridor"])
def test_clearance_is_that_of_samples_of_the_true_motion(scenario):
    """A lower bound that is close, where the step is 0.1 s; and a collision exactly where samples overlap."""
    env, rng = RobotEnv(scenario), np.random.default_rng(5)
    shape, h, ends = env.worlds.scenarios[0].robot.shape, env.worlds.period, set()
    for seed in range(4):
        observation, _ = env.reset(seed=seed, options={SEED: seed})
        going = True
        while going:
            d = env.worlds.dimension
            p, v, now = env.worlds.position[0, 0].copy(), env.worlds.velocity[0, 0].copy(), env.worlds.now()
            aim = observation[d : 2 * d] / np.linalg.norm(observation[d : 2 * d])
            observation, _, ended, late, info = env.step(aim + rng.normal(0.0, 0.3, d))
            a, t = (env.worlds.velocity[0, 0] - v) / h, np.linspace(0.0, h, 41)[:, None]
            path, times = p + t * v + 0.5 * t * t * a, now + t[:, 0]
            there = [o for o in env.worlds.scenarios[0].obstacles if o.exists(now) and o.exists(now + h)]
            least = min((clearances(o, shape, times, path).min() for o in there), default=np.inf)
            way = np.linalg.norm(h * v) + 0.1 if scenario == "corridor" else 0.06
            assert info["clearance"] <= least + 1e-6
            assert min(least, 50.0) <= info["clearance"] + way
            assert (info["outcome"] == "collision") == (least < -1e-5)
            going = not (ended or late)
        ends.add(info["outcome"])
    assert "collision" in ends


def test_a_kink_within_a_step_is_not_missed():
    """An obstacle that touches the robot between the ends of a step, by a track with a corner there."""
    track = Sampled([0.0, 0.05, 0.1, 9.0], [(0.0, 3.0), (0.0, 0.5), (0.0, 3.0), (0.0, 3.0)], "linear")
    robot = Robot(Disc(0.4), Limits(1.0, 1.0), State((0, 0), (0, 0)), Goal(Stationary((9.0, 0.0)), 0.5))
    env = RobotEnv(Scenario("kink", (robot,), (Obstacle(Disc(0.4), track),)))
    env.reset(seed=0)
    _, reward, ended, _, info = env.step(np.zeros(2))
    assert ended
    assert info["outcome"] == "collision"
    assert info["clearance"] == pytest.approx(-0.3, abs=1e-4)
    assert reward == pytest.approx(-1.0 - 0.1 / 60.0)


@pytest.mark.parametrize("distance", [5.8, 6.2, 30.0, 34.3])
def test_a_goal_that_is_passed_within_a_step_is_reached(distance):
    """At 20 m/s and with a period of 0.2 s samples are 4 m apart; a goal to stop at is not reached so."""
    v, first = (20.0, 0.0), np.ceil((distance - np.sqrt(0.5**2 - 0.2**2)) / 4.0)
    for stop in (False, True):
        goal = Goal(Stationary((distance, 0.2)), 0.5, stop)
        robots = [Robot(Disc(0.4), Limits(20.0, 4.0), State((0, 0), v), goal, "a")]
        env = RobotEnv(Scenario("fast", tuple(robots), dt=0.2))
        robots.append(Robot(Disc(0.4), Limits(20.0, 4.0), State((0, 50), v), Goal(Stationary((500.0, 50.0))), "b"))
        fleet = FleetEnv(Scenario("fast", tuple(robots), dt=0.2))
        env.reset(seed=0)
        fleet.reset(seed=0)
        for step in range(1, int(first) + 1):
            _, reward, ended, _, info = env.step(np.zeros(2))
            _, rewards, gone, _, infos = fleet.step(dict.fromkeys(fleet.agents, np.zeros(2)))
            arrives = not stop and step == first
            assert (ended, gone["a"], info["is_success"], infos["a"]["is_success"]) == (arrives,) * 4
            before, after = (np.hypot(distance - 4.0 * k, 0.2) for k in (step - 1, step))
            expected = (before - after) / np.hypot(distance, 0.2) - 0.2 / 60.0 + arrives
            assert (reward, rewards["a"]) == pytest.approx((expected, expected))
        assert info["time"] == pytest.approx(0.2 * first)


def test_a_goal_in_motion_that_is_passed_within_a_step_is_reached():
    goal = Goal(Sampled([0.0, 9.0], [(9.0, 0.2), (0.0, 0.2)], "linear"), 0.5)
    robot = Robot(Disc(0.4), Limits(20.0, 4.0), State((0, 0), (20, 0)), goal)
    env = RobotEnv(Scenario("fast", (robot,), dt=0.2))
    env.reset(seed=0)
    outcomes = [env.step(np.zeros(2))[4]["outcome"] for _ in range(3)]
    assert outcomes == ["running", "running", "arrived"]


def test_actions_obey_the_limits():
    for command in ("acceleration", "velocity"):
        env, rng = RobotEnv("empty", command=command), np.random.default_rng(0)
        env.reset(seed=0)
        for _ in range(50):
            before = env.worlds.velocity[0, 0].copy()
            env.step(rng.uniform(-1.5, 1.5, 2))
            assert np.linalg.norm(env.worlds.velocity[0, 0] - before) <= 0.1 * 1.0 + 1e-12
            assert np.linalg.norm(env.worlds.velocity[0, 0]) <= 2.0 + 1e-12


def test_the_observation_is_what_the_page_says():
    robot = Robot(Disc(0.5), Limits(2.0, 1.0), State((0, 0), (1, 0)), Goal(Stationary((6.0, 0.0)), 0.5))
    rock, wall = (
        Obstacle(Disc(1.0), Stationary((0.0, 6.0))),
        Obstacle(Polyline([(-3, -4), (3, -4)]), Stationary((0, 0))),
    )
    moon = Obstacle(Disc(0.7), Circular((3.0, 0.0), 4.0, 1.0))
    far = Obstacle(Disc(1.0), Stationary((50.0, 0.0)))
    observation, _ = RobotEnv(Scenario("s", (robot,), (far, wall, rock, moon)), nearest=4).reset(seed=0)
    own, rows = observation[:6], observation[6:].reshape(4, 6)
    np.testing.assert_allclose(own, [0.5, 0.0, 0.5, 0.0, -0.25, 0.0], atol=1e-6)
    # Sight is 2 m/s times 6 s. By clearance: the wall 3.5 m, the rock 4.5 m, the moon 5.8 m.
    np.testing.assert_allclose(rows[0], [1, 0, -4 / 12, -0.25, 0, 0.5 / 12], atol=1e-6)
    np.testing.assert_allclose(rows[1], [1, 0, 6 / 12, -0.25, 0, 1.5 / 12], atol=1e-6)
    np.testing.assert_allclose(rows[2], [1, 7 / 12, 0, -0.25, 0.25, 1.2 / 12], atol=1e-6)
    assert not rows[3].any()


def test_returns_of_an_arrival_and_of_the_end_of_time():
    env = RobotEnv("empty", settings={"distance": 4.0, "duration": 20.0})
    observation, _ = env.reset(seed=0)
    total, going = 0.0, True
    while going:
        observation, reward, ended, late, info = env.step(0.5 * towards_goal(observation) - 2.0 * observation[:2])
        total, going = total + reward, not (ended or late)
    assert info["is_success"]
    # Progress is the way to where it stops, within the tolerance of 0.2 m of 4 m.
    assert total == pytest.approx(1.0 + 1.0 - info["time"] / 20.0, abs=0.05)
    env.reset(seed=0)
    steps = [env.step(np.zeros(2)) for _ in range(200)]
    assert [late for _, _, _, late, _ in steps] == [False] * 199 + [True]
    assert sum(reward for _, reward, *_ in steps) == pytest.approx(-1.0)


def test_many_worlds_are_single_environments_to_the_bit():
    """Also after some of them have ended and begun again."""
    many, rng = RobotsEnv(3, "roundabout_crossing", nearest=3), np.random.default_rng(1)
    single = [RobotEnv("roundabout_crossing", nearest=3) for _ in range(3)]
    observations, _ = many.reset(seed=7)
    for k, env in enumerate(single):
        assert np.array_equal(observations[k], env.reset(seed=7 + k)[0])
    over, ends = [False] * 3, 0
    for _ in range(60):
        actions = rng.uniform(-1, 1, (3, 2)) + np.array([0.7, 0.0])
        observations, rewards, ended, late, info = many.step(actions)
        for k, env in enumerate(single):
            if over[k]:
                found = (*env.reset(), 0.0, False, False)
                assert np.array_equal(observations[k], found[0])
                assert rewards[k] == 0.0
                over[k] = False
                continue
            seen, reward, stop, out, about = env.step(actions[k])
            assert np.array_equal(observations[k], seen)
            assert (rewards[k], ended[k], late[k]) == (reward, stop, out)
            assert info["outcome"][k] == about["outcome"]
            assert info["clearance"][k] == about["clearance"]
            over[k] = stop or out
            ends += over[k]
    assert ends >= 3


def test_layouts_are_built_once_and_repeat():
    built = []
    env = RobotEnv(lambda seed: built.append(seed) or gallery.build("head_on", {"duration": 0.5}), layouts=2)
    for k in range(10):
        env.reset(seed=k)
    assert sorted(set(built[1:])) == [0, 1]
    assert len(built) == 3


@pytest.mark.parametrize("name", ["roundabout_crossing", "crowdnav"])
@pytest.mark.parametrize("command", ["acceleration", "velocity"])
def test_a_blind_policy_collides_without_the_filter_and_not_with_it(name, command):
    if name == "crowdnav":
        pytest.importorskip("pyrvo", reason="the package pyrvo is not installed")
    for seed in range(2):
        bare, rng = RobotEnv(name, command=command), np.random.default_rng(seed)
        for env in (bare, SafetyFilter(bare)):
            observation, _ = env.reset(seed=seed, options={SEED: seed})
            going, changed = True, 0
            while going:
                observation, _, ended, late, info = env.step(towards_goal(observation, rng.normal(0, 0.3, 2)))
                going, changed = not (ended or late) and info["time"] < 12.0, changed + info.get("intervened", 0)
                assert info.get("certified", True)
            assert (info["outcome"] == "collision") == (env is bare)
        assert changed > 0


def test_a_unicycle_turns_brakes_and_never_drives_backwards():
    env = RobotEnv("empty", command="unicycle")
    env.reset(seed=0)
    worlds = env.worlds
    limits, h = worlds.scenarios[0].robot.limits, worlds.period
    for action, along in (((1.0, 0.0), 1.0), ((0.0, 1.0), 0.0), ((0.0, -1.0), 0.0)):
        v = worlds.velocity[0, 0].copy()
        env.step(np.array(action))
        a, ahead = (worlds.velocity[0, 0] - v) / h, v / max(np.linalg.norm(v), 1e-12)
        assert np.linalg.norm(a) == pytest.approx(limits.max_acceleration)
        if v.any():
            assert a @ ahead == pytest.approx(along * limits.max_acceleration, abs=1e-9)
            assert np.sign(ahead[0] * a[1] - ahead[1] * a[0]) == action[1]
    for _ in range(5):
        env.step(np.array([-1.0, 0.0]))
    assert np.linalg.norm(worlds.velocity[0, 0]) < 1e-12


def test_discrete_actions_are_the_largest_accelerations():
    env = RobotEnv("empty", command="discrete")
    for k in range(int(env.action_space.n)):
        env.reset(seed=0)
        v = env.worlds.velocity[0, 0].copy()
        env.step(k)
        a = (env.worlds.velocity[0, 0] - v) / env.worlds.period / env.worlds.scenarios[0].robot.limits.max_acceleration
        expected = 0.0 if k == 0 else np.exp(2j * np.pi * (k - 1) / 8)
        assert complex(*a) == pytest.approx(expected, abs=1e-9)


def test_rays_end_where_points_of_them_first_overlap():
    """Of a scene with a disc, a wall with a radius and a thin wall; beside points on rays, tested one by one."""
    robot = Robot(Disc(0.5), Limits(2.0, 1.0), State((0.3, 0.1), (0, 0)), Goal(Stationary((6.0, 0.0)), 0.5))
    bodies = (
        Obstacle(Disc(1.0), Stationary((4.0, 3.0))),
        Obstacle(Polyline([(-3, -4), (3, -4), (5, -1)]), Stationary((0, 0))),
        Obstacle(Capsule((-1.0, 0.0), (1.0, 0.5), 0.4), Stationary((-4.0, 1.0))),
    )
    env, reached = RobotEnv(Scenario("rays", (robot,), bodies), observe=lambda worlds: worlds.rays(48)), 0
    found = env.reset(seed=0)[0]
    assert found.shape == env.observation_space.shape == (48,)
    steps = np.arange(0.0, 12.0, 0.005)
    for k, share in enumerate(found):
        way = np.array([np.cos(2 * np.pi * k / 48), np.sin(2 * np.pi * k / 48)])
        points = np.array([0.3, 0.1]) + steps[:, None] * way
        inside = np.min([clearances(o, Disc(1e-9), np.zeros(len(steps)), points) for o in bodies], axis=0) <= 0.005
        first = steps[inside.argmax()] if inside.any() else np.inf
        assert share * 12.0 == pytest.approx(min(max(first - 0.5, 0.0), 12.0), abs=0.06)
        reached += share < 1.0
    assert 20 < reached < 48


def test_functions_of_the_worlds_observe_and_reward():
    env = RobotsEnv(
        3, "empty", observe=lambda worlds: worlds.velocity, reward=lambda worlds, made: -worlds.velocity[..., 0]
    )
    env.reset(seed=0)
    observations, rewards, *_ = env.step(np.tile([1.0, 0.0], (3, 1)))
    np.testing.assert_array_equal(observations, env.worlds.velocity[:, 0].astype(np.float32))
    np.testing.assert_array_equal(rewards, -env.worlds.velocity[:, 0, 0])
    wrong = RobotEnv("empty", reward=lambda worlds, made: np.zeros(3))
    wrong.reset(seed=0)
    with pytest.raises(InvalidInput, match="rewards: expected"):
        wrong.step(np.zeros(2))


@pytest.mark.parametrize("command", ["acceleration", "discrete", "unicycle"])
def test_blind_policies_of_a_fleet_collide_without_the_filter_and_not_with_it(command):
    for filtered in (False, True):
        bare = FleetEnv("circle", settings={"robots": 5, "duration": 14.0}, command=command)
        env, ends, changed = FleetSafetyFilter(bare) if filtered else bare, [], 0
        seen, _ = env.reset(seed=0)
        while env.agents:
            wanted = {name: seen[name][2:4] for name in env.agents}
            if command == "discrete":
                wanted = {name: 1 + round(np.arctan2(a[1], a[0]) * 4 / np.pi) % 8 for name, a in wanted.items()}
            if command == "unicycle":
                wanted = dict.fromkeys(wanted, np.array([1.0, 0.0]))
            seen, _, _, _, infos = env.step(wanted)
            ends += [info["outcome"] for info in infos.values() if info["outcome"] != "running"]
            changed += sum(info.get("intervened", False) for info in infos.values())
        assert ("collision" in ends) != filtered
        assert (changed > 0) == filtered


def test_the_filter_changes_no_safe_action():
    env = SafetyFilter(gymnasium.make("slalom/empty-v0"))
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(40):
        info = env.step(rng.uniform(-1, 1, 2))[-1]
        assert not info["intervened"]
        np.testing.assert_allclose(info["applied"], info["wanted"], atol=1e-9)
        assert info["filter"] == "CLEAR"


@pytest.mark.parametrize("command", ["acceleration", "velocity"])
def test_the_filter_of_many_worlds_is_that_of_each_to_the_bit(command):
    """Also after some of them have ended and begun again."""
    source = {"scenario": lambda seed: gallery.build("head_on", {"offset": 0.1 * (seed % 7), "duration": 1.2})}
    many, rng = VectorSafetyFilter(RobotsEnv(3, nearest=2, command=command, **source)), np.random.default_rng(1)
    single = [SafetyFilter(RobotEnv(nearest=2, command=command, **source)) for _ in range(3)]
    observations, _ = many.reset(seed=7)
    for k, env in enumerate(single):
        assert np.array_equal(observations[k], env.reset(seed=7 + k)[0])
    over, ends, changed = [False] * 3, 0, 0
    for _ in range(20):
        actions = rng.uniform(-1, 1, (3, 2)) + np.array([0.7, 0.0])
        observations, rewards, ended, late, info = many.step(actions)
        for k, env in enumerate(single):
            assert info["_intervened"][k] != over[k]
            if over[k]:
                assert np.array_equal(observations[k], env.reset()[0])
                assert (info["intervened"][k], info["certified"][k], info["filter"][k]) == (False, True, "")
                over[k] = False
                continue
            seen, reward, stop, out, about = env.step(actions[k])
            assert np.array_equal(observations[k], seen)
            assert (rewards[k], ended[k], late[k]) == (reward, stop, out)
            for name in ("intervened", "certified", "filter", "wanted", "applied"):
                assert np.array_equal(info[name][k], about[name])
            over[k] = stop or out
            ends, changed = ends + over[k], changed + about["intervened"]
    assert ends >= 3
    assert changed > 0


@pytest.mark.slow
def test_filtered_robots_follow_what_was_applied_while_other_worlds_begin():
    lengths = lambda seed: gallery.build("head_on", {"offset": 0.1, "duration": 0.5 + 0.2 * (seed % 3)})  # noqa: E731
    many, seen = VectorSafetyFilter(RobotsEnv(3, lengths)), 0
    many.reset(seed=0)
    worlds = many.unwrapped.worlds
    for _ in range(12):
        before = worlds.velocity[:, 0].copy()
        info = many.step(np.tile([1.0, 0.0], (3, 1)))[-1]
        some = info["_applied"]
        follows = (worlds.velocity[:, 0] - before) / worlds.period
        np.testing.assert_allclose(follows[some], info["applied"][some], atol=1e-9)
        seen += bool(some.any() and not some.all())
    assert seen


def test_many_blind_policies_collide_without_the_filter_and_not_with_it():
    bare = RobotsEnv(12, "roundabout_crossing", layouts=12)
    hits = []
    for env in (bare, VectorSafetyFilter(bare)):
        rng, (observations, _) = np.random.default_rng(0), env.reset(seed=3)
        over, hit = np.zeros(12, np.bool_), np.zeros(12, np.bool_)
        for _ in range(40):
            aim = observations[:, 2:4] / np.linalg.norm(observations[:, 2:4], axis=1)[:, None]
            observations, _, ended, late, info = env.step(aim + rng.normal(0.0, 0.3, (12, 2)))
            hit |= ~over & (info["outcome"] == "collision")
            over |= ended | late
        hits.append(int(hit.sum()))
    assert hits[0] > 5
    assert hits[1] == 0


def test_robots_that_stop_stay_and_others_leave():
    def at(x, stop, name):
        return Robot(
            Disc(0.3), Limits(1.0, 1.0), State((x, 0.0), (0.5, 0.0)), Goal(Stationary((x + 0.1, 0.0)), 0.6, stop), name
        )

    env = FleetEnv(Scenario("two", (at(0.0, True, "stays"), at(5.0, False, "passes"), at(10.0, True, "third"))))
    env.reset(seed=0)
    still = {name: np.zeros(2) for name in env.agents}
    *_, ended, _, info = env.step(still)
    assert ended == dict.fromkeys(("stays", "passes", "third"), True)
    assert {about["outcome"] for about in info.values()} == {"arrived"}
    assert env.agents == []
    assert env.worlds.there[0].tolist() == [True, False, True]


def test_two_robots_that_meet_both_collide():
    def heading(x, speed, name):
        state = State((x, 0.0), (speed, 0.0))
        return Robot(Disc(0.5), Limits(2.0, 1.0), state, Goal(Stationary((-x, 0.0)), 0.2), name)

    env = FleetEnv(Scenario("meet", (heading(-1.0, 2.0, "left"), heading(1.0, -2.0, "right"))))
    env.reset(seed=0)
    for _ in range(3):
        found = env.step({name: np.zeros(2) for name in env.agents})
        if not env.agents:
            break
    assert {name: about["outcome"] for name, about in found[-1].items()} == dict.fromkeys(
        ("left", "right"), "collision"
    )
    assert found[-1]["left"]["time"] == pytest.approx(0.3)


PAIR = {"robot 000": np.zeros(2), "robot 001": np.zeros(2)}
NUMBERS = np.array([1, 2, 3], dtype=np.int64)


def reset(env):
    """An environment at the start of an episode."""
    env.reset(seed=0)
    return env


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda action: reset(RobotEnv("empty")).step(action), "action: expected"),
        (lambda action: reset(SafetyFilter(RobotEnv("empty"))).step(action), "action: expected"),
        (lambda action: reset(RobotsEnv(2, "empty")).step(action), "actions: expected"),
        (lambda action: reset(VectorSafetyFilter(RobotsEnv(2, "empty"))).step(action), "actions: expected"),
        (
            lambda action: reset(FleetEnv("circle", settings={"robots": 2})).step({**PAIR, "robot 001": action}),
            r"actions\['robot 001'\]: expected",
        ),
        (lambda action: reset(FleetEnv("circle", settings={"robots": 2})).step(action), "actions: expected"),
    ],
)
@pytest.mark.parametrize("action", [3, "x", None, [1.0], NUMBERS, [np.nan, 0.0], {"x": 1}, [None, None], 1j])
def test_actions_of_wrong_kinds_and_shapes_are_refused(call, said, action):
    with pytest.raises(InvalidInput, match=said):
        call(action)


def test_seeds_may_be_numbers_of_numpy():
    env = RobotEnv("roundabout_crossing")
    first, second = (env.reset(options={SEED: seed})[0] for seed in (3, NUMBERS[2]))
    assert np.array_equal(first, second)


def test_pictures_show_the_step():
    env = RobotEnv("head_on", render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    env.step(np.ones(2))
    after = env.render()
    assert before.shape == after.shape == (480, 480, 3)
    assert (before != after).any()
    window = FleetEnv("circle", render_mode="human")
    window.reset(seed=0)
    window.step({name: np.zeros(2) for name in window.agents})
    assert window.render() is None
    window.close()


def test_an_episode_of_a_filtered_policy_is_recorded_as_it_was():
    """Positions, arrival and clearance, with the metrics of a run; a second episode replaces the first."""
    run = record(SafetyFilter(RobotEnv("head_on", command="velocity")))
    for seed in (1, 2):
        seen, places, infos, ended = run.reset(seed=seed)[0], [], [], False
        while not ended:
            places.append(run.unwrapped.worlds.position[0].copy())
            seen, _, late, over, info = run.step(towards_goal(seen))
            infos, ended = [*infos, info], late or over
    found = run.recording
    assert np.array_equal(found.positions[:-1], places)
    assert found.arrived[0] == pytest.approx(infos[-1]["time"])
    assert (found.names, found.obstacles[0].name) == (("robot",), "car")
    assert metrics.summary(found)["collisions"] == 0
    assert metrics.min_clearance(found) == pytest.approx(min(one["clearance"] for one in infos), abs=1e-3)


def test_robots_that_collide_leave_a_recorded_episode():
    parts = Disc(0.3), Limits(1.0, 1.0)
    one, other = (
        Robot(*parts, State((x, 0.0), (v, 0.0)), Goal(Stationary((8.0 * v, 0.0)), stop=True), name)
        for x, v, name in ((-1.0, 1.0, "left"), (1.0, -1.0, "right"))
    )
    late = Robot(*parts, State((0.0, 5.0), (0.0, 0.0)), Goal(Stationary((2.0, 5.0)), 0.3, stop=True), "apart")
    run = record(FleetEnv(Scenario("meet", (one, other, late), duration=6.0), command="velocity"))
    seen, _ = run.reset(seed=0)
    while run.agents:
        seen = run.step({name: towards_goal(seen[name]) * (0.5 if name == "apart" else 1.0) for name in run.agents})[0]
    found = run.recording
    assert metrics.summary(found)["collisions"] > 0
    assert found.arrived[0] == found.arrived[1] == pytest.approx(0.8)
    assert found.steps_of(0).stop < found.steps_of(2).stop == len(found.times)
    assert metrics.max_acceleration(found, 0) <= 1.0 + 1e-9
