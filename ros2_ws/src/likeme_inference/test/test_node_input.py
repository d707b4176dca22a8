"""The inference node and bad input: messages, parameters, model files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from fakes import Camera, demonstration
from rcl_interfaces.srv import DescribeParameters, SetParameters
from rclpy.parameter import Parameter

from graph import LATCHED, Graph
from in_process import refusal
from likeme_core.paper_world import WORLD
from likeme_inference.inference_node import main
from likeme_inference.node_settings import settings_of
from likeme_inference.tabletop.model_file import format_model, save, shipped
from likeme_inference.tabletop.robot_model import RobotModel
from likeme_msgs.msg import Decision, GoalBelief

pytestmark = pytest.mark.graph
L, R, O = WORLD.states  # noqa: E741


def set_parameter(graph: Graph, name: str, value: Any) -> Any:
    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    return graph.call(SetParameters, 'inference_node/set_parameters', request).results[0]


def facts(array: DiagnosticArray) -> dict[str, str]:
    return {item.key: item.value for item in array.status[0].values}


def test_invalid_demonstrations_are_counted_and_logged_once(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        node = graph.start('likeme_inference.inference_node')
        camera = Camera(graph)
        beliefs = graph.collect(GoalBelief, 'goal_belief', LATCHED)
        diagnostics = graph.collect(DiagnosticArray, '/diagnostics')
        unknown_state, unlikely = demonstration('pear', L, R), demonstration('pear', L, R)
        unknown_state.x_f = 3
        unlikely.x_f_probability = [0.0, 0.93, 0.0]
        for bad in (demonstration('plum', L, R), unknown_state, unlikely):
            camera.send(bad)
        dropped = 'demonstrations dropped'
        graph.until(
            lambda: diagnostics and facts(diagnostics[-1]).get(dropped) == '3', 10, 'diagnostics'
        )
        camera.show('pear', R, L)
        graph.until(lambda: beliefs, 10, 'a belief of a good demonstration')

        status = diagnostics[-1].status[0]
        assert status.level == b'\x01'
        assert 'messages were dropped just now' in status.message
        assert node.said.count('dropped so far') == 1
        assert (
            '1 demonstrations dropped so far, the last one because: Expected an object'
            in node.said
        )
        assert len(beliefs) == 1


def test_parameter_ranges_are_published(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node')
        numbers = {n: s for n, s in settings_of(WORLD).items() if s.limits}
        request = DescribeParameters.Request(names=list(numbers))
        told = graph.call(DescribeParameters, 'inference_node/describe_parameters', request)

    spans = [descriptor.floating_point_range[0] for descriptor in told.descriptors]
    assert [(span.from_value, span.to_value) for span in spans] == [
        setting.limits for setting in numbers.values()
    ]


def test_a_process_with_bad_parameters_does_not_start(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        node = graph.start('likeme_inference.inference_node', help_threshold=1.5)
        assert node.wait(20) == os.EX_CONFIG
        assert 'inference_node does not start: ' in node.said
        assert 'help_threshold' in node.said
        assert 'Traceback' not in node.said


@pytest.mark.parametrize(
    ('arguments', 'why'),
    [
        ({'mode': 'telepathy'}, "got 'telepathy'"),
        ({'goal_prior': [0.5, 0.4, 0.03]}, 'to sum to 1, got 0.93'),
        ({'model_file': '/no/such/file'}, '/no/such/file: No such file'),
        ({'model_file': '~no_such_user/m.csv'}, '~no_such_user/m.csv: Could not determine home'),
        ({'goal_prior': []}, 'Expected goal_prior as 3 probabilities, got None.'),
        ({'experience_store': 'sqlite://', 'robot': 'end'}, 'and not "end", got \'end\''),
        ({'experience_store': 'sqlite://', 'robot': ''}, "got ''"),
    ],
)
def test_bad_parameters_are_refused_with_a_sentence(arguments: dict[str, Any], why: str) -> None:
    assert why in refusal(main, 'inference_node', **arguments)


def test_a_model_that_lacks_an_object_of_the_world(tmp_path: Path) -> None:
    """The node starts, says so, and does not imitate the object until a prior is set."""
    rows = tuple(row for row in shipped().rows if row.object != 'chicken')
    plum = rows[0]._replace(object='plum')
    path = tmp_path / 'other.csv'
    save(RobotModel('other', '1', shipped().sources, (*rows, plum)), path)
    with Graph(tmp_path) as graph:
        node = graph.start('likeme_inference.inference_node', model_file=str(path))
        camera = Camera(graph)
        decisions = graph.collect(Decision, 'decision', LATCHED)
        beliefs = graph.collect(GoalBelief, 'goal_belief', LATCHED)
        camera.show('chicken', R, L)
        refused = graph.until(lambda: decisions, 20, 'a decision').pop()
        assert set_parameter(graph, 'prior', 'structured').successful
        assert set_parameter(graph, 'asking', 'promise').successful
        assert set_parameter(graph, 'costs', [0.1, 0.5, 2.0, 0.0, 0.1]).successful
        camera.show('chicken', L, R)
        belief = graph.until(lambda: beliefs, 10, 'a belief').pop()
        assert node.stop() == 0

    assert (refused.kind, refused.action, refused.x_i) == (Decision.NO_ACTION, 255, L)
    assert 'other 1 has no trials of it: not imitated, as no prior is set' in refused.sentence
    assert (belief.object, belief.goal) == ('chicken', R)
    assert belief.posterior[R] > 0.6
    assert 'other 1 has no trials of chicken: not imitated, as no prior is set' in node.said
    assert 'other 1 has trials of plum, which the world chung2015 lacks: not used.' in node.said
    assert 'Traceback' not in node.said


def test_parameters_are_rejected_or_apply_from_the_next_decision(tmp_path: Path) -> None:
    good = tmp_path / 'good.csv'
    good.write_text(format_model(shipped()).replace('name,chung2015_robot', 'name,copy'))
    torn = tmp_path / 'torn.csv'
    torn.write_text(good.read_text()[:300])
    with Graph(tmp_path) as graph:
        graph.start('likeme_inference.inference_node')
        camera = Camera(graph)
        decisions = graph.collect(Decision, 'decision', LATCHED)
        refused = [
            set_parameter(graph, name, value)
            for name, value in [
                ('help_threshold', -0.1), ('mode', 'telepathy'), ('goal_prior', [0.5, 0.5]),
                ('goal_prior', [0.9, 0.0, 0.03]), ('arm_wait', 0.0), ('help_threshold', 'half'),
                ('model_file', str(torn)), ('model_file', str(tmp_path / 'none.csv')),
                ('goal_prior', 3), ('goal_prior', ['a', 'b', 'c']), ('goal_prior', 'left'),
                ('goal_prior', None), ('model_file', '~no_such_user/model.csv'),
            ]
        ]  # fmt: skip
        camera.show('pear', R, L)
        before = graph.until(lambda: decisions, 10, 'AT_GOAL').pop()
        accepted = [
            set_parameter(graph, name, value)
            for name, value in [('model_file', str(good)), ('help_threshold', 0.3)]
        ]
        camera.show('pear', L, R)
        after = graph.until(lambda: decisions, 10, 'a decision').pop()

        assert not any(result.successful for result in refused)
        assert 'torn.csv: line ' in refused[6].reason
        assert 'No such file' in refused[7].reason
        assert (before.model, before.threshold, before.mode) == (
            'chung2015_robot 1', 0.5, 'interactive',
        )  # fmt: skip
        assert all(result.successful for result in accepted)
        assert (after.kind, after.model, after.threshold) == (Decision.EXECUTE, 'copy 1', 0.3)
