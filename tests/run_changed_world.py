"""Run one act in the world chung2015 of the likeme_core on the path: OBJECT FROM TO MANNER.

A person shows it; perception, messages, model and decision follow; the robot copies it. Prints
what was seen, decided and done, as JSON.
"""

from __future__ import annotations

import json
import sys

from builtin_interfaces.msg import Time
from std_msgs.msg import Header

from likeme_core.tabletop import Manner, Mode
from likeme_core.world import load_world
from likeme_experiments.imitation.demonstration import (
    background_of,
    human_action,
    new_perception,
    temporary_cell,
)
from likeme_experiments.imitation.imitation_cell import ImitationCell
from likeme_inference.session_inputs import read_demonstration
from likeme_inference.tabletop.imitation import ImitationSettings, decide
from likeme_perception import messages
from worlds_parts.world_run import never_fails

SEED = 1


def main(name: str, start: str, end: str, manner: str) -> None:
    """Run the act."""
    world = load_world()
    x_i = world.state(start)
    shown = world.action_of(Manner[manner], world.state(end))
    assert shown is not None
    with temporary_cell(world, name) as cell:
        cell.restart(SEED)
        cell.reset([name], [x_i], SEED)
        perception = new_perception(world, cell, background_of(world, name))
        (act,) = human_action(cell, perception, name, shown)
    header = Header(frame_id='camera', stamp=Time(sec=1))
    demo = read_demonstration(messages.demonstration(act, header, world), world)
    with temporary_cell(world, name) as cell:
        turn = ImitationCell(world, cell, name, x_i, SEED)
        settings = ImitationSettings(world=world, mode=Mode.TRAJECTORY)
        decision = decide(never_fails(world), settings, demo, turn.start, 1)
        assert decision.action is not None
        done = turn.execute((), decision.action)
    sys.stdout.write(
        json.dumps(
            {
                'seen': [demo.object, demo.x_i.name, demo.x_f.name, demo.manner.name],
                'decided': [decision.goal.name, decision.action.name, decision.sentence],
                'done': [done.report.outcome.name, done.view.states[name].name],
            }
        )
    )


if __name__ == '__main__':
    main(*sys.argv[1:])
