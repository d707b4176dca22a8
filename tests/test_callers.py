"""arm, show and cell as a person runs them, against stand-in services on their own domain."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import pytest
import rclpy
from domain_coordinator import domain_id
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from std_srvs.srv import Trigger

from in_process import Answer, command
from likeme_bringup.ros import cell_commands as commands
from likeme_bringup.ros import service_client
from likeme_core.paper_world import LEFT, WORLD
from likeme_core.ros.world import WorldPublisher
from likeme_msgs.msg import ObjectState, TableState
from likeme_msgs.srv import ExecuteAction, ResetCell

pytestmark = pytest.mark.graph
BOUND = 120.0


class StandIn(NamedTuple):
    """A cell made of services that answer at once, and what they were asked."""

    domain: int
    node: Any
    asked: list[Any]


@pytest.fixture(scope='module')
def domain() -> Iterator[int]:
    with domain_id() as number:
        yield number


@pytest.fixture(scope='module')
def cell(domain: int) -> Iterator[StandIn]:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = rclpy.create_node('stand_in_cell', context=context)
    asked: list[Any] = []

    def act(request: Any, response: Any) -> Any:
        asked.append(request)
        response.success = request.object != 'lemon'
        response.message = (
            'The gripper closed on nothing.' if request.object == 'lemon' else 'Done.'
        )
        return response

    def simple(request: Any, response: Any) -> Any:
        asked.append(request)
        response.success, response.message = True, 'Done.'
        return response

    node.create_service(ExecuteAction, 'arm/execute_action', act)
    node.create_service(ExecuteAction, 'human/execute_action', act)
    node.create_service(ResetCell, 'cell/reset', simple)
    node.create_service(Trigger, 'cell/hold', simple)
    table = node.create_publisher(TableState, 'table_state', 1)
    world = WorldPublisher(node, WORLD)
    state = TableState(objects=[ObjectState(name='pear', state=LEFT)])
    node.create_timer(0.1, lambda: table.publish(state))
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)

    def spin() -> None:
        with contextlib.suppress(ExternalShutdownException):
            executor.spin()

    thread = threading.Thread(target=spin)
    thread.start()
    yield StandIn(domain, node, asked)
    del world
    executor.shutdown()
    thread.join(BOUND)
    node.destroy_node()
    context.try_shutdown()


def process(domain: int, *words: str) -> Answer:
    """Run a command in a process of its own."""
    told = subprocess.run(
        [sys.executable, '-m', 'likeme_bringup.ros.cell_commands', *words],
        capture_output=True,
        text=True,
        timeout=BOUND,
        check=False,
        env=os.environ | {'ROS_DOMAIN_ID': str(domain)},
    )
    return Answer(told.returncode, told.stdout, told.stderr)


def test_the_arm_is_asked_by_names(cell: StandIn) -> None:
    answer = process(cell.domain, 'arm', 'push_left', 'pear')
    assert (answer.code, answer.stdout) == (0, 'Done.\n'), answer.stderr
    request = cell.asked.pop()
    assert (request.object, request.action) == ('pear', 'push_left')


def test_a_motion_that_was_not_completed_is_exit_code_1(cell: StandIn) -> None:
    answer = process(cell.domain, 'arm', 'place_left', 'lemon')
    assert (answer.code, answer.stderr) == (1, 'The gripper closed on nothing.\n')


def test_a_demonstration_is_made_of_manner_and_target(cell: StandIn) -> None:
    answer = process(cell.domain, 'show', 'pear', 'left', 'right', '--by', 'push')
    assert answer.code == 0, answer.stderr
    assert cell.asked.pop().action == 'PUSH_RIGHT'


def test_a_demonstration_from_elsewhere_is_not_begun(cell: StandIn) -> None:
    before = len(cell.asked)
    answer = process(cell.domain, 'show', 'pear', 'right', 'left')
    assert answer.code == 1
    assert answer.stderr.startswith('The camera sees the pear left, not right')
    assert len(cell.asked) == before


def test_force_goes_on(cell: StandIn) -> None:
    answer = process(cell.domain, 'show', 'pear', 'right', 'left', '--force')
    assert answer.code == 0, answer.stderr
    assert cell.asked.pop().action == 'PLACE_LEFT'


def test_an_object_the_camera_does_not_know(cell: StandIn) -> None:
    answer = process(cell.domain, 'show', 'apple', 'right', 'left')
    assert (answer.code, answer.stderr) == (1, 'The camera knows pear, not apple.\n')


def test_reset_takes_places(cell: StandIn) -> None:
    answer = process(cell.domain, 'cell', 'reset', 'pear=left', 'lemon=offtable', '--seed', '3')
    assert answer.code == 0, answer.stderr
    request = cell.asked.pop()
    assert (request.objects, list(request.states), request.seed) == (
        ['pear', 'lemon'],
        ['left', 'offtable'],
        3,
    )


def test_hold(cell: StandIn) -> None:
    assert process(cell.domain, 'cell', 'hold').code == 0


def test_a_service_that_is_not_there_is_exit_code_3(
    cell: StandIn, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service_client, 'DISCOVERY_TIMEOUT', 0.5)
    answer = command(commands.cell, cell.domain, 'resume')
    assert answer.code == 3
    assert answer.stderr.startswith('Nobody serves cell/resume on ROS domain')


def test_wrong_usage_of_a_process_is_exit_code_2(domain: int) -> None:
    assert process(domain, 'cell', 'dance').code == 2


@pytest.mark.parametrize(
    ('entry_point', 'words'),
    [
        (commands.arm, ('push_left',)),
        (commands.show, ('pear', 'left')),
        (commands.cell, ('reset', 'pear=')),
        (commands.arm, ('push_left', 'pear', '--domain', '400')),
    ],
)
def test_wrong_usage_is_exit_code_2(
    domain: int, entry_point: Callable[[], None], words: tuple[str, ...]
) -> None:
    assert command(entry_point, domain, *words).code == 2
