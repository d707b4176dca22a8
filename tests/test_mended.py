"""A node that was killed comes back; the state of the cell in one line."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Mapping
from typing import Any

import psutil
import pytest
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile

from graph import Graph, NodeProcess
from likeme_bringup.cell_status import EXPECTED
from likeme_core.heartbeats import NodeRecord, NodeState
from likeme_core.ros.heartbeat import HeartbeatPublisher, HeartbeatSubscriber
from likeme_msgs.msg import HelpRequest, HoldState, TableState
from likeme_msgs.srv import AskHuman

pytestmark = pytest.mark.graph
START_CELL = (sys.executable, '-m', 'likeme_bringup.start_cell')
STATUS = (sys.executable, '-m', 'likeme_bringup.ros.cell_commands', 'cell', 'status')
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def test_a_killed_perception_comes_back(tmp_path: Any) -> None:
    with Graph(tmp_path) as graph:
        nodes = HeartbeatSubscriber(graph.node).monitor.nodes
        tables = graph.collect(TableState, 'table_state')
        words = ('--only', 'arm', '--only', 'perception', '--seed', '1')
        cell = graph.run('cell', *START_CELL, *words)
        graph.until(lambda: tables, 30, 'a table state')
        first = nodes['/perception_node'].run
        victims = [
            child
            for child in psutil.Process(cell.pid).children()
            if 'likeme_perception.perception_node' in child.cmdline()
        ]
        victims[0].kill()
        graph.until(lambda: nodes['/perception_node'].run != first, 30, 'a new run')
        tables.clear()
        graph.until(lambda: tables, 30, 'a table state again')
        graph.until(lambda: nodes['/perception_node'].state is NodeState.READY, 10, 'READY')

        assert 'perception was ended by SIGKILL; starting it again now (restart 1).' in cell.said
        assert cell.stop() == 0


def kill_inference(graph: Graph, cell: NodeProcess, nodes: Mapping[str, NodeRecord]) -> None:
    """Kill the inference node of a cell and wait until it is back."""
    first = nodes['/inference_node'].run
    for child in psutil.Process(cell.pid).children():
        if 'likeme_inference.inference_node' in child.cmdline():
            child.kill()
    graph.until(lambda: nodes['/inference_node'].run != first, 30, 'a new run')


def test_what_was_set_in_a_run_is_set_after_a_restart(tmp_path: Any) -> None:
    wanted = [Parameter('help_threshold', value=0.9), Parameter('mode', value='sequential')]
    change = SetParameters.Request(parameters=[each.to_parameter_msg() for each in wanted])
    ask = GetParameters.Request(names=[each.name for each in wanted])
    leave = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_DEACTIVATE))
    with Graph(tmp_path) as graph:
        nodes = HeartbeatSubscriber(graph.node).monitor.nodes
        cell = graph.run('cell', *START_CELL, '--only', 'inference', '--threshold', '0.4')
        graph.until(lambda: '/inference_node' in nodes, 30, 'a heartbeat')
        service = 'inference_node/set_parameters'
        assert graph.call(SetParameters, service, change, again=2).results[0].successful
        kill_inference(graph, cell, nodes)
        graph.until(lambda: nodes['/inference_node'].state is NodeState.READY, 20, 'READY')
        service = 'inference_node/get_parameters'
        threshold, mode = graph.call(GetParameters, service, ask, again=2).values
        assert (threshold.double_value, mode.string_value) == (0.9, 'sequential')
        assert 'Started again in the same run, with what was set in it' in cell.said

        graph.call(ChangeState, 'inference_node/change_state', leave, again=2)
        graph.until(lambda: 'not active' in nodes['/inference_node'].message, 20, 'inactive')
        kill_inference(graph, cell, nodes)
        graph.until(lambda: 'Not active, as before' in cell.said, 20, 'what it says')
        graph.until(lambda: 'not active' in nodes['/inference_node'].message, 20, 'inactive')
        assert cell.stop() == 0

        cell = graph.run('cell', *START_CELL, '--only', 'inference', '--threshold', '0.4')
        graph.until(lambda: 'Show me something' in cell.said, 30, 'a new run of the cell')
        graph.until(lambda: nodes['/inference_node'].state is NodeState.READY, 20, 'READY')
        threshold, mode = graph.call(GetParameters, service, ask, again=2).values
        assert (threshold.double_value, mode.string_value) == (0.4, 'interactive')
        assert cell.stop() == 0


def status(graph: Graph, *words: str) -> subprocess.CompletedProcess[str]:
    """The command's output and exit code."""
    return subprocess.run(
        [*STATUS, *words], env=graph.env, capture_output=True, text=True, timeout=90, check=False
    )


def test_the_state_of_a_cell_in_one_line(tmp_path: Any) -> None:
    with Graph(tmp_path) as graph:
        nodes = {name: graph.background_node(name) for name in EXPECTED}
        health = dict.fromkeys(EXPECTED, (NodeState.READY, ''))
        beats = [
            HeartbeatPublisher(node, lambda name=name: health[name])
            for name, node in nodes.items()
        ]
        keeper, held = nodes['hold_keeper'], HoldState()
        holds = keeper.create_publisher(HoldState, 'cell/hold_state', LATCHED)
        keeper.create_timer(0.05, lambda: holds.publish(held))
        pending = [HelpRequest(id=4, object='pear', question='Shall I?')]

        def ask(_: AskHuman.Request, response: AskHuman.Response) -> AskHuman.Response:
            response.success, response.pending = True, pending
            return response

        nodes['inference_node'].create_service(AskHuman, 'ask_human', ask)
        ready = status(graph)
        held.held, held.by = True, 'anna'
        health['arm_driver'] = (NodeState.STARTING, 'it warms up')
        told = status(graph, '--json')

    version = beats[0].version
    assert ready.stdout == (
        'motion allowed | hold_keeper ready | arm_driver ready | perception_node ready | '
        f'inference_node ready, 1 question open | {version}\n'
    ), ready.stderr
    assert ready.returncode == 0
    assert told.returncode == 1
    cell = json.loads(told.stdout)
    assert cell['motion'] == {'allowed': False, 'why': 'held by anna'}
    assert cell['nodes']['arm_driver']['message'] == 'it warms up'
    assert cell['questions'] == [{'id': 4, 'object': 'pear', 'question': 'Shall I?'}]
