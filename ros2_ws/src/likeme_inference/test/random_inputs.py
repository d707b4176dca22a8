"""Random sequences of a session's inputs that go through all of its phases."""

from __future__ import annotations

import random
from collections.abc import Iterator

from session_values import ns, shown, table

from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import WORLD
from likeme_core.tabletop import Manner
from likeme_inference.session_inputs import CameraSilence, InputValue, OperatorAnswer
from likeme_inference.tabletop.session import ImitationSession
from likeme_inference.tabletop.session_state import Phase
from likeme_inference.tabletop.values import MotionReport, Reply


def random_inputs(
    chance: random.Random, session: ImitationSession, steps: int
) -> Iterator[InputValue]:
    """Inputs that fit the phase that the session is in when the next one is asked for."""
    now, where = 1.0, {name: chance.choice(WORLD.states[:2]) for name in WORLD.objects}
    for _ in range(steps):
        now += chance.choice([0.03, 0.3, 3.0, 0.03, 0.3, 30.0 if chance.random() < 0.1 else 1.0])
        if chance.random() < 0.01:
            now = 1.0
        phase, kind = session.phase, chance.random()
        if phase is Phase.ACTING and kind < 0.3:
            outcome = chance.choice([*MotionOutcome, MotionOutcome.COMPLETED, None])
            yield MotionReport(outcome, 'Said.', ns(now) if chance.random() < 0.8 else 0)
        elif phase is Phase.ASKING and kind < 0.1:
            yield OperatorAnswer(chance.choice(list(Reply)), 'Ada')
        elif session.state.suspended and kind < 0.2:
            about = chance.choice(session.state.suspended).demonstration
            name = about.object if about else ''
            yield OperatorAnswer(chance.choice(list(Reply)), 'Ada', name)
        elif phase is Phase.CONFIRMING and kind < 0.05:
            yield CameraSilence()
        elif kind < 0.45:
            name = chance.choice(WORLD.objects) if chance.random() < 0.25 else 'pear'
            x_f = chance.choice([state for state in WORLD.states if state != where[name]])
            yield shown(name, where[name], x_f, now, chance.choice(list(Manner)[:2]))
            where[name] = x_f
        else:
            hidden = {n: s for n, s in where.items() if chance.random() < 0.95}
            view = table(now, settled=chance.random() < 0.8)
            yield type(view)(view.stamp, view.frame, view.settled, hidden)
