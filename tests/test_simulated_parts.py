"""Arm, person and camera of the simulator started apart, beside stand-ins for real ones."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter

from graph import HOLD_KEEPER, LATCHED, Graph
from in_process import refusal
from likeme_arm_sim.arm_driver_node import main
from likeme_core.paper_world import WORLD
from likeme_core.ros.time import stamp_ns
from likeme_msgs.msg import Decision, Outcome, TableState
from likeme_msgs.srv import ExecuteAction, ResetCell

pytestmark = pytest.mark.graph
DRIVER = 'likeme_arm_sim.arm_driver_node'
PARTS = ('arm', 'person', 'camera')
#: Each part simulated and not simulated, and all of them.
SUBSETS = [['arm'], ['person', 'camera'], list(PARTS)]
#: What the node serves and publishes for each part; a hold keeper is a node of its own.
SERVICES = {
    'arm': {'/arm/execute_action', '/arm/motion_status'},
    'person': {'/human/execute_action', '/human/motion_status'},
    'camera': {'/cell/reset'},
}
TOPICS = {
    'arm': {'/joint_states'},
    'person': set[str](),
    'camera': {
        '/camera/rgb/image_rect_color', '/camera/rgb/camera_info',
        '/camera/depth_registered/image_rect',
    },
}  # fmt: skip
#: s for a process to start on a loaded machine, and for a motion.
START, MOTION = 60.0, 90.0


def known_names(found: list[tuple[str, list[str]]], known: dict[str, Any]) -> set[str]:
    every = set().union(*known.values()) | {'/clock'}
    return {name for name, _ in found} & every


def statuses(messages: list[DiagnosticArray]) -> list[DiagnosticStatus]:
    return [s for message in messages for s in message.status if s.name == 'arm_driver']


@pytest.mark.parametrize('parts', SUBSETS, ids='+'.join)
def test_what_is_not_simulated_is_neither_served_nor_published(
    tmp_path: Path, parts: list[str]
) -> None:
    with Graph(tmp_path) as graph:
        diagnostics = graph.collect(DiagnosticArray, '/diagnostics')
        graph.start(DRIVER, simulate=parts)
        # The first message comes after every service and topic was created.
        graph.until(lambda: statuses(diagnostics), START, 'diagnostics')
        node = graph.node
        services = set().union(*(SERVICES[part] for part in parts))
        topics = set().union(*(TOPICS[part] for part in parts))
        if len(parts) == len(PARTS):
            topics |= {'/clock'}

        def complete() -> bool:
            served = node.get_service_names_and_types_by_node('arm_driver', '/')
            published = node.get_publisher_names_and_types_by_node('arm_driver', '/')
            return (
                known_names(served, SERVICES) == services
                and known_names(published, TOPICS) == topics
            )

        graph.until(complete, START, f'{services} and {topics}')


def test_a_process_with_settings_that_do_not_fit_is_refused(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        driver = graph.start(DRIVER, simulate=['camera'], real_time_factor=0.0)
        assert driver.wait(START) == os.EX_CONFIG
        assert 'Expected real_time_factor 1' in driver.said
        assert 'Traceback' not in driver.said


def test_a_part_that_cannot_be_simulated_is_refused() -> None:
    said = refusal(main, 'arm_driver', simulate=['legs'])
    assert "parts of arm, person, camera, got 'legs'" in said


def test_a_simulated_arm_acts_on_what_a_real_camera_sees(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        # The stand-in for a real camera: frames of another cell, under another node name.
        camera = graph.run(
            'camera', *module(DRIVER, '-r', '__node:=kinect', '-p', 'simulate:=[camera]')
        )
        tables = graph.collect(TableState, 'table_state')
        graph.start('likeme_perception.perception_node')
        graph.start(HOLD_KEEPER)
        graph.start(DRIVER, simulate=['arm', 'person'])
        graph.until(lambda: tables and tables[-1].settled, START, 'a table at rest')
        assert camera.alive
        assert graph.node.count_publishers('camera/rgb/image_rect_color') == 1
        # Stamps are of the system clock.
        assert abs(stamp_ns(tables[-1].header.stamp) - time.time_ns()) < 30e9

        # Nothing is in the way of the lemon with this seed.
        request = ExecuteAction.Request(object='lemon', action='push_right')
        before = time.time_ns()
        answer = graph.call(ExecuteAction, 'arm/execute_action', request, MOTION)
        assert answer.success, answer.message
        assert before < stamp_ns(answer.started) < stamp_ns(answer.finished) < time.time_ns()

        factor = Parameter('real_time_factor', value=2.0).to_parameter_msg()
        wanted = SetParameters.Request(parameters=[factor])
        refused = graph.call(SetParameters, 'arm_driver/set_parameters', wanted).results[0]
        assert not refused.successful
        assert 'Expected real_time_factor 1' in refused.reason


def module(name: str, *ros_arguments: str) -> list[str]:
    return [sys.executable, '-m', name, '--ros-args', *ros_arguments]


class StandInArm:
    """A node that serves arm/execute_action and answers at once."""

    def __init__(self, graph: Graph) -> None:
        self.requests: list[tuple[str, str]] = []
        node = graph.background_node('real_arm')
        node.create_service(ExecuteAction, 'arm/execute_action', self._execute)

    def _execute(
        self, request: ExecuteAction.Request, response: ExecuteAction.Response
    ) -> ExecuteAction.Response:
        self.requests.append((request.object, request.action))
        response.success, response.message = True, 'Done.'
        return response


@pytest.mark.timeout(400)
def test_a_real_arm_acts_on_what_the_simulated_camera_sees(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        arm = StandInArm(graph)
        tables = graph.collect(TableState, 'table_state')
        decisions = graph.collect(Decision, 'decision', LATCHED)
        outcomes = graph.collect(Outcome, 'outcome', LATCHED)
        graph.start(HOLD_KEEPER)
        graph.start(DRIVER, simulate=['camera', 'person'])
        graph.start('likeme_perception.perception_node')
        graph.start('likeme_inference.inference_node', outcome_timeout=3.0)
        graph.until(lambda: tables and tables[-1].settled, START, 'a table at rest')
        assert graph.node.count_services('arm/execute_action') == 1

        reset = ResetCell.Request(objects=['chicken'], states=['right'], seed=5)
        assert graph.call(ResetCell, 'cell/reset', reset, START).success
        tables.clear()
        graph.until(lambda: tables and tables[-1].settled, START, 'a table at rest')
        for action, kind in (
            ('place_left', Decision.AT_GOAL),
            ('place_right', Decision.EXECUTE),
        ):
            request = ExecuteAction.Request(object='chicken', action=action)
            assert graph.call(ExecuteAction, 'human/execute_action', request, MOTION).success
            graph.until(lambda k=kind: decisions and decisions[-1].kind == k, START, 'a decision')
        graph.until(lambda: outcomes, START, 'an outcome')
        # The stand-in moved nothing, and the camera says so.
        assert arm.requests == [('chicken', WORLD.actions[decisions[-1].action].name)]
        assert outcomes[-1].result == Outcome.MISSED


def test_a_second_arm_is_reported(tmp_path: Path) -> None:
    sentence = 'arm/execute_action is served by node real_arm too'
    with Graph(tmp_path) as graph:
        diagnostics = graph.collect(DiagnosticArray, '/diagnostics')
        graph.start(DRIVER)
        graph.until(lambda: statuses(diagnostics), START, 'diagnostics')
        assert statuses(diagnostics)[-1].level != DiagnosticStatus.ERROR
        StandInArm(graph)
        graph.until(
            lambda: statuses(diagnostics)[-1].level == DiagnosticStatus.ERROR, START, 'an error'
        )
        assert sentence in statuses(diagnostics)[-1].message


def test_the_simulated_arm_does_not_start_beside_another(tmp_path: Path) -> None:
    sentence = 'arm/execute_action is served by node real_arm too'
    with Graph(tmp_path) as graph:
        StandInArm(graph)
        diagnostics = graph.collect(DiagnosticArray, '/diagnostics')
        driver = graph.start(DRIVER)

        def noticed() -> bool:
            # Discovery may take longer than the start: then the diagnostics say so.
            return not driver.alive or any(sentence in s.message for s in statuses(diagnostics))

        graph.until(noticed, START, 'the second arm to be noticed')
        assert driver.alive or sentence in driver.said
