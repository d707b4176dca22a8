"""Whether a promised rate of success is kept: at the start, and after the world changed.

Robots of 10 trials a pair in the real robot's table (judgement_robots, seed 1) promise a share of
the 12 changes in which the goal is reached with one action, help counting as success. Realised:
the exact success of that asking in the table. After a shift (seed 2) they go on, one random change
an episode, with outcomes counted; the exact success over the 12 changes at an episode is averaged
over five episodes before and after it.
"""

from __future__ import annotations

from argparse import Namespace

import numpy as np

from judgement_robots import GOAL, MODEL, OBJECT, TABLE, X_I, Learned, best_actions, robots
from likeme_inference.tabletop.arrays import FloatArray
from likeme_inference.tabletop.promise import asking_probabilities, promise
from report import Bar

WORLDS = 1000
TARGETS = (0.8, 0.9, 0.95)
#: Estimate that promises are made by; the others are reported beside it.
PROMISING = 'shared'
#: Episodes before and after the shift, and robots it happens to.
BEFORE, AFTER, SHIFTED = 60, 65, 1000
#: Share of pushes that leave the object where it is; of placings that end off the table.
SLIPPING, DROPPED = 0.4, 0.3


def bars(options: Namespace) -> list[Bar]:
    """Static promises and promises after a shift."""
    number = WORLDS if options.worlds is None else max(1, options.worlds)
    learned = robots(number, seed=1)
    estimates = {name: [getattr(robot, name) for robot in learned] for name in Learned._fields}
    shared = estimates['shared']
    made = [bar for name, each in estimates.items() for bar in _static(each, name)]
    return made + _shifted(shared[:SHIFTED])


def _static(learned: list[FloatArray], estimate: str) -> list[Bar]:
    made: list[Bar] = []
    bound = estimate == PROMISING
    known = TABLE[OBJECT, X_I, :, GOAL].max(axis=-1)
    for target in TARGETS:
        realised, helped = [], []
        for alpha in learned:
            action, predicted = best_actions(alpha)
            asked = asking_probabilities(predicted, target)
            success = TABLE[OBJECT, X_I, action, GOAL]
            realised.append(np.mean(asked + (1 - asked) * success))
            helped.append(asked.mean())
        oracle = asking_probabilities(known, target).mean()
        what, n = f'promise {target:.2f}, {estimate}', len(learned)
        gap, low = abs(np.mean(realised) - target), target - np.quantile(realised, 0.05)
        made += [
            Bar(f'{what}: realised', float(np.mean(realised)), None, '', n=n),
            Bar(f'{what}: off on average', 100 * gap, 0.5 if bound else None, 'points', n=n),
            Bar(
                f'{what}: 5 % quantile under it', 100 * float(low), 5.0 if bound else None,
                'points', n=n,
            ),
            Bar(
                f'{what}: help', 100 * float(np.mean(helped)),
                100 * float(oracle) + 8 if bound else None, '%', 'oracle + 8 points', n,
            ),
        ]  # fmt: skip
    return made


def _shifts() -> dict[str, FloatArray]:
    slip, drop = TABLE.copy(), TABLE.copy()
    for x in np.flatnonzero(~MODEL.domain.stuck):
        for a, name in enumerate(MODEL.domain.actions):
            changed, share, end = (slip, SLIPPING, x) if 'PUSH' in name else (drop, DROPPED, 2)
            changed[:, x, a] *= 1 - share
            changed[:, x, a, end] += share
    return {'pushes slip': slip, 'placings drop': drop}


def _shifted(learned: list[FloatArray]) -> list[Bar]:
    made = []
    for name, world in _shifts().items():
        kept = np.array([_episodes(alpha, world, [2, k]) for k, alpha in enumerate(learned)])
        for episode, bar in ((0, None), (20, None), (40, None), (60, 1.0)):
            around = kept[:, BEFORE + max(0, episode - 5) : BEFORE + episode + 5].mean()
            made.append(
                Bar(
                    f'promise 0.90 after {name}: off at episode {episode}',
                    100 * abs(float(around) - 0.9), bar, 'points', n=len(learned),
                )
            )  # fmt: skip
    return made


def _episodes(alpha: FloatArray, shifted: FloatArray, seed: list[int]) -> list[float]:
    """Exact success over the changes at each episode."""
    rng, alpha = np.random.default_rng(seed), alpha.copy()
    state, kept = promise(best_actions(alpha)[1], 0.9), []
    for episode in range(BEFORE + AFTER):
        world = TABLE if episode < BEFORE else shifted
        action, predicted = best_actions(alpha)
        asked = np.array([state.asks(success) for success in predicted.tolist()])
        kept.append(float(np.where(asked, 1.0, world[OBJECT, X_I, action, GOAL]).mean()))
        task = int(rng.integers(len(action)))
        if asked[task]:
            state = state.after(acted=False, reached=None)
            continue
        at = OBJECT[task], X_I[task], action[task]
        x_f = int(rng.choice(3, p=world[at]))
        state = state.after(acted=True, reached=x_f == GOAL[task])
        alpha[(*at, x_f)] += 1
    return kept
