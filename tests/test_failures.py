"""Nodes that die or freeze in mid-action, cells that are there twice, scripts without a cell."""

from __future__ import annotations

import math
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil
import pytest
from sensor_msgs.msg import JointState

from graph import HOLD_KEEPER, LATCHED, Graph, NodeProcess
from likeme_core.outcomes import MotionOutcome
from likeme_msgs.msg import Decision, Outcome, TableState
from likeme_msgs.srv import ExecuteAction, ResetCell

pytestmark = pytest.mark.graph
SCRIPTS = Path(__file__).parents[1] / 'scripts'
START_CELL = (sys.executable, '-m', 'likeme_bringup.start_cell')
Act = ExecuteAction.Request
ACTION_TIMEOUT = 5.0
#: Nothing in the way of a push of the chicken.
ALONE = ResetCell.Request(
    objects=['chicken', 'pear', 'lemon'], states=['right', 'offtable', 'offtable']
)
#: rad by which a joint that stands still may seem to move.
STILL = 2e-3


def begin(graph: Graph, who: str, name: str, action: str) -> Any:
    """Ask arm or human to act; the future of the answer."""
    return graph.send(ExecuteAction, f'{who}/execute_action', Act(object=name, action=action), 30)


def act(graph: Graph, who: str, name: str, action: str) -> ExecuteAction.Response:
    """Have arm or human act; the answer."""
    future = begin(graph, who, name, action)
    graph.until(future.done, 60, 'an answer')
    return future.result()


def until_moving(graph: Graph, joints: list[JointState]) -> None:
    """Wait until the arm has moved from where it is."""
    graph.until(lambda: joints, 30, 'joint_states')
    first = joints[-1].position
    graph.until(lambda: math.dist(joints[-1].position, first) > 0.2, 30, 'the arm to move')


def at_rest(table: TableState, name: str) -> bool:
    """Whether the camera sees an object, and sees nothing move."""
    return table.settled and any(o.name == name and o.visible for o in table.objects)


def children(process: NodeProcess) -> dict[str, psutil.Process]:
    """The nodes under a start_cell, by the last word of their module."""
    found = psutil.Process(process.pid).children(recursive=True)
    modules = {child: next((w for w in child.cmdline() if '_node' in w), '') for child in found}
    return {module.rpartition('.')[2]: child for child, module in modules.items()}


@pytest.mark.parametrize('victim', ['hold_keeper_node', 'arm_driver_node', 'inference_node'])
def test_without_respawn_all_end_with_one_node(tmp_path: Path, victim: str) -> None:
    with Graph(tmp_path) as graph:
        cell = graph.run('cell', *START_CELL, '--seed', '1', '--no-respawn')
        motion = begin(graph, 'human', 'chicken', 'place_left')
        nodes = graph.until(lambda: len(c := children(cell)) == 4 and c, 10, 'four nodes')
        graph.during(1.0)
        assert not motion.done()
        nodes[victim].kill()
        begun = time.monotonic()

        assert cell.wait(15) == 1
        assert time.monotonic() - begun < 10
        name = victim.partition('_')[0]
        assert f'{name} was ended by SIGKILL; ending the others.' in cell.said
        assert 'Traceback' not in cell.said
        assert not [node for node in nodes.values() if node.is_running()]


@pytest.mark.slow
def test_the_arm_is_killed_in_mid_action_and_comes_back(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        arm_words = (*START_CELL, '--only', 'hold', '--only', 'arm', '--seed', '1', '--no-respawn')
        arm = graph.run('arm', *arm_words)
        graph.start('likeme_perception.perception_node')
        thinking = graph.start('likeme_inference.inference_node', action_timeout=ACTION_TIMEOUT)
        joints = graph.collect(JointState, 'joint_states')
        decisions = graph.collect(Decision, 'decision', LATCHED)
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        tables = graph.collect(TableState, 'table_state')
        graph.until(lambda: tables, 30, 'a table state')
        assert graph.call(ResetCell, 'cell/reset', ALONE).success
        graph.until(lambda: tables[-1].settled and at_rest(tables[-1], 'chicken'), 20, 'rest')
        assert act(graph, 'human', 'chicken', 'place_left').success
        graph.until(lambda: decisions, 20, 'AT_GOAL')
        assert act(graph, 'human', 'chicken', 'place_right').success
        graph.until(lambda: decisions[-1].kind == Decision.EXECUTE, 20, 'EXECUTE')
        until_moving(graph, joints)
        children(arm)['arm_driver_node'].kill()
        assert arm.wait(10) == 1
        graph.run('arm_again', *arm_words)
        outcome = graph.until(lambda: outcomes, 40, 'an outcome').pop()
        joints.clear()
        graph.until(lambda: joints, 30, 'the new arm')
        graph.during(3.0)

        # The arm may have moved: the camera looks.
        assert outcome.motion_outcome == MotionOutcome.LOST
        assert outcome.result in (Outcome.REACHED, Outcome.MISSED, Outcome.NOT_SEEN)
        assert max(math.dist(j.position, joints[0].position) for j in joints) < STILL
        assert not outcomes
        assert thinking.alive

        tables.clear()
        assert graph.call(ResetCell, 'cell/reset', ALONE).success
        graph.until(lambda: tables and at_rest(tables[-1], 'chicken'), 20, 'the chicken')
        ended: list[int] = []

        def has_heard() -> bool:
            ended.append(act(graph, 'arm', 'chicken', 'push_left').outcome)
            return ended[-1] != Act.OBJECT_NOT_SEEN

        graph.until(has_heard, 20, 'the new arm to hear of the chicken')
        assert ended[-1] == Act.COMPLETED


def test_an_arm_that_freezes_for_a_while_goes_on(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start(HOLD_KEEPER)
        arm = graph.start('likeme_arm_sim.arm_driver_node', seed=1)
        motion = begin(graph, 'human', 'chicken', 'place_left')
        joints = graph.collect(JointState, 'joint_states')
        graph.until(lambda: len(joints) > 20, 20, 'joint_states')
        arm.signal(signal.SIGSTOP)
        graph.during(3.0)
        assert not motion.done()
        arm.signal(signal.SIGCONT)
        graph.until(motion.done, 30, 'an answer')
        assert motion.result().success


def test_a_second_cell_on_the_same_domain_is_refused(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        first = graph.run('first', *START_CELL, '--only', 'inference')
        graph.until(lambda: 'Show me something' in first.said, 20, 'the first cell')
        second = graph.run('second', *START_CELL)
        assert second.wait(20) == 1
        other = graph.run('other', *START_CELL, '--only', 'perception')
        graph.until(lambda: 'perception on ROS domain' in other.said, 20, 'the other part')

        assert second.said == (
            f'inference already runs on ROS domain {graph.domain}: stop that cell, or choose '
            'another domain with --domain.\n'
        )
        assert first.alive
        first.signal(signal.SIGKILL)
        third = graph.run('third', *START_CELL, '--only', 'inference')
        graph.until(lambda: 'Show me something' in third.said, 20, 'a cell after the first')


@pytest.mark.parametrize(
    ('words', 'why'),
    [
        (('--domain', '500'), '--domain'),
        (('--params', '/no/such/file.yaml'), "'/no/such/file.yaml' does not exist"),
        (('--only', 'legs'), "'legs' is not one of"),
        (('--mode', 'telepathy'), "'telepathy' is not one of"),
    ],
)
def test_a_cell_with_wrong_words_does_not_start(
    tmp_path: Path, words: tuple[str, ...], why: str
) -> None:
    told = subprocess.run(
        [SCRIPTS / 'start_cell.sh', *words], capture_output=True, text=True, timeout=90,
        cwd=tmp_path, check=False,
    )  # fmt: skip
    assert told.returncode == 2
    assert why in told.stderr
    assert 'Traceback' not in told.stderr


def test_scripts_without_a_cell(tmp_path: Path) -> None:
    link = tmp_path / 'a link to a script.sh'
    link.symlink_to(SCRIPTS / 'ask_human.sh')
    commands = (
        [SCRIPTS / 'arm.sh', 'push_left', 'pear'],
        [SCRIPTS / 'show.sh', 'pear', 'left', 'right'],
        [SCRIPTS / 'cell.sh', 'hold'],
        [SCRIPTS / 'cell.sh', 'status'],
        [link, 'list'],
    )
    with Graph(tmp_path) as graph:
        runs = [
            subprocess.Popen(
                command, cwd=tmp_path, env=graph.env, stderr=subprocess.PIPE, text=True
            )
            for command in commands
        ]
        said = [run.communicate(timeout=90)[1] for run in runs]

    assert [run.returncode for run in runs] == [3] * len(runs)
    assert all(sentence.count('\n') == 1 for sentence in said), said
    assert 'is the cell running?' in said[0]
