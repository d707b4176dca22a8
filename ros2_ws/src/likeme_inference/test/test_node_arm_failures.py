"""The inference node when the arm is absent, silent, late, refusing or killed in the middle."""

from __future__ import annotations

import signal
import sys
import time
from pathlib import Path

import pytest
from fakes import Arm, Camera

from graph import LATCHED, Graph, NodeProcess
from likeme_core.outcomes import MotionOutcome
from likeme_core.paper_world import WORLD
from likeme_core.ros.time import stamp_ns
from likeme_msgs.msg import Decision, Outcome

pytestmark = pytest.mark.graph
L, R, O = WORLD.states  # noqa: E741
FAKE_ARM = Path(__file__).with_name('fake_arm_process.py')
#: s: Fast DDS holds the arm alive for this long after its last sign (20 s by default).
DDS_LEASE = 5.0
SHORT_LEASE = f"""
<dds xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles"><profiles>
  <participant profile_name="short_lease" is_default_profile="true"><rtps><builtin>
    <discovery_config>
      <leaseDuration><sec>{DDS_LEASE:.0f}</sec></leaseDuration>
      <leaseAnnouncement><sec>1</sec></leaseAnnouncement>
    </discovery_config>
  </builtin></rtps></participant>
</profiles></dds>
"""


def start(graph: Graph, **parameters: float) -> tuple[NodeProcess, Camera, list[Outcome]]:
    node = graph.start('likeme_inference.inference_node', **parameters)
    return node, Camera(graph), graph.collect(Outcome, 'outcome', LATCHED)


def let_act(graph: Graph, camera: Camera) -> Decision:
    """Show chicken RIGHT to LEFT and put it back, so that the robot decides to push."""
    seen = graph.collect(Decision, 'decision', LATCHED)
    camera.show('chicken', R, L)
    graph.until(lambda: seen and seen[-1].kind == Decision.AT_GOAL, 20, 'AT_GOAL')
    camera.show('chicken', L, R)
    graph.until(lambda: seen[-1].kind == Decision.EXECUTE, 10, 'EXECUTE')
    return seen[-1]


def test_arm_absent(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        _, camera, outcomes = start(graph, arm_wait=1.0)
        let_act(graph, camera)
        asked = time.monotonic()
        outcome = graph.until(lambda: outcomes, 5, 'ARM_FAILED').pop()
        waited = time.monotonic() - asked
        arm = Arm(graph, camera)
        graph.during(1.5)

        assert (outcome.result, outcome.motion_outcome) == (Outcome.ARM_FAILED, 255)
        assert (outcome.x_f, outcome.actor) == (255, Outcome.ROBOT)
        assert 'was not there within 1 s' in outcome.sentence
        assert waited < 2
        assert arm.requests == outcomes == []


def test_a_late_answer_is_ignored_and_the_next_decision_works(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        node, camera, outcomes = start(graph, action_timeout=1.0)
        arm = Arm(graph, camera)
        arm.may_answer.clear()
        let_act(graph, camera)
        outcome = graph.until(lambda: outcomes, 5, 'ARM_FAILED').pop()
        arm.may_answer.set()
        graph.until(lambda: 'Late report of the arm ignored' in node.said, 5, 'a log line')
        camera.states['chicken'] = int(R)
        let_act(graph, camera)
        second = graph.until(lambda: outcomes, 5, 'a second outcome').pop()

        assert (outcome.result, outcome.motion_outcome) == (Outcome.ARM_FAILED, 255)
        assert 'the arm gave no answer within 1 s' in outcome.sentence
        assert (second.result, second.decision_id) == (Outcome.REACHED, outcome.decision_id + 2)
        assert len(arm.requests) == 2


@pytest.mark.parametrize('motion', [MotionOutcome.BUSY, MotionOutcome.EXPIRED])
def test_a_refusal_fails_with_its_reason(tmp_path: Path, motion: MotionOutcome) -> None:
    with Graph(tmp_path) as graph:
        _, camera, outcomes = start(graph)
        arm = Arm(graph, camera)
        arm.outcome = motion
        let_act(graph, camera)
        outcome = graph.until(lambda: outcomes, 5, 'ARM_FAILED').pop()

        assert (outcome.result, outcome.motion_outcome) == (Outcome.ARM_FAILED, motion)
        assert f'Outcome {motion.value}.' in outcome.sentence


def test_requests_say_when_they_expire(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        _, camera, outcomes = start(graph, arm_wait=3.0)
        arm = Arm(graph, camera)
        seen = let_act(graph, camera)
        graph.until(lambda: outcomes, 5, 'an outcome')

        expires = stamp_ns(arm.requests[0].expires)
        assert expires == stamp_ns(seen.header.stamp) + 3 * 10**9


def test_a_camera_that_falls_silent_has_not_seen_it(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        _, camera, outcomes = start(graph, outcome_timeout=1.0)
        arm = Arm(graph, camera)
        arm.may_answer.clear()
        let_act(graph, camera)
        graph.until(lambda: arm.requests, 5, 'a request')
        camera.stop()
        arm.may_answer.set()
        outcome = graph.until(lambda: outcomes, 5, 'NOT_SEEN').pop()

        assert (outcome.result, outcome.x_f) == (Outcome.NOT_SEEN, 255)
        assert outcome.motion_outcome == MotionOutcome.COMPLETED


def test_a_table_that_never_settles_has_not_been_seen(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        _, camera, outcomes = start(graph, outcome_timeout=2.0)
        arm = Arm(graph, camera)
        arm.may_answer.clear()
        let_act(graph, camera)
        graph.until(lambda: arm.requests, 5, 'a request')
        camera.settled = False
        arm.may_answer.set()

        assert graph.until(lambda: outcomes, 5, 'NOT_SEEN').pop().result == Outcome.NOT_SEEN


def test_arm_killed_in_the_middle_and_back_again(tmp_path: Path) -> None:
    profiles = tmp_path / 'short_lease.xml'
    profiles.write_text(SHORT_LEASE)
    setting = f'FASTRTPS_DEFAULT_PROFILES_FILE={profiles}'
    with Graph(tmp_path) as graph:
        _, camera, outcomes = start(graph)
        arm = graph.run('arm_killed', 'env', setting, sys.executable, str(FAKE_ARM))
        let_act(graph, camera)
        graph.until(lambda: 'Request: action PUSH_LEFT chicken' in arm.said, 10, 'the request')
        arm.signal(signal.SIGKILL)
        killed = time.monotonic()
        outcome = graph.until(lambda: outcomes, DDS_LEASE + 10, 'ARM_FAILED').pop()
        detected = time.monotonic() - killed
        back = Arm(graph, camera)
        graph.during(2)

        assert outcome.result == Outcome.ARM_FAILED
        assert 'the arm service vanished' in outcome.sentence
        assert detected < DDS_LEASE + 3
        assert back.requests == outcomes == []


def test_a_new_arm_does_not_inherit_the_request_of_a_killed_one(tmp_path: Path) -> None:
    with Graph(tmp_path) as graph:
        _, camera, outcomes = start(graph, action_timeout=4.0)
        arm = graph.run('arm_killed', sys.executable, str(FAKE_ARM))
        let_act(graph, camera)
        graph.until(lambda: 'Request: action PUSH_LEFT chicken' in arm.said, 10, 'the request')
        arm.signal(signal.SIGKILL)
        back = Arm(graph, camera)
        outcome = graph.until(lambda: outcomes, 8, 'ARM_FAILED').pop()

        assert outcome.result == Outcome.ARM_FAILED
        assert 'the arm gave no answer within 4 s' in outcome.sentence
        assert back.requests == []
