"""The state of a cell in one line, from what was heard of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

from likeme_core.heartbeats import NodeRecord, NodeState, described

#: What a cell consists of, in the order of the line.
EXPECTED = ('hold_keeper', 'arm_driver', 'perception_node', 'inference_node')
ASKS = 'inference_node'


class MotionPermission(NamedTuple):
    """Whether the arm may move, and if not, why."""

    allowed: bool
    why: str = ''


class Question(NamedTuple):
    """A request for help that waits for an answer."""

    id: int
    object: str
    question: str


@dataclass(frozen=True)
class NodeStatus:
    """One node.

    Attributes:
        state: a NodeState in lower case, `silent` (it was heard, and is no more) or `absent`.
        message: why it is not ready.
    """

    state: str
    message: str = ''
    version: str = ''
    restarts: int = 0

    def __str__(self) -> str:
        again = ', restarted' if self.restarts else ''
        return self.state + (f': {self.message}' if self.message else '') + again


@dataclass(frozen=True)
class CellStatus:
    """A cell.

    Attributes:
        nodes: by name: the expected ones, and others that were heard.
        questions: those that are open; None: the inference node did not tell.
    """

    motion: MotionPermission
    nodes: Mapping[str, NodeStatus]
    questions: tuple[Question, ...] | None = None

    @property
    def in_service(self) -> bool:
        """Whether motion is allowed and every node is ready."""
        ready = all(node.state == 'ready' for node in self.nodes.values())
        return self.motion.allowed and ready

    @property
    def line(self) -> str:
        """The cell in one line."""
        motion = 'motion allowed' if self.motion.allowed else f'motion {self.motion.why}'
        nodes = [f'{name} {node}{self._asked(name)}' for name, node in self.nodes.items()]
        return ' | '.join([motion, *nodes, self._versions()])

    def as_json(self) -> dict[str, Any]:
        """The same for programs."""
        asked = self.questions
        return {
            'in_service': self.in_service,
            'motion': self.motion._asdict(),
            'nodes': {name: asdict(node) for name, node in self.nodes.items()},
            'questions': None if asked is None else [question._asdict() for question in asked],
        }

    def _asked(self, name: str) -> str:
        if name != ASKS or not self.questions:
            return ''
        return f', {len(self.questions)} question{"s" * (len(self.questions) > 1)} open'

    def _versions(self) -> str:
        versions = {name: node.version for name, node in self.nodes.items() if node.version}
        if len(set(versions.values())) <= 1:
            return next(iter(versions.values()), 'version unknown')
        return 'versions differ: ' + ', '.join(f'{n} {v}' for n, v in versions.items())


def node_statuses(
    heard: Mapping[str, NodeRecord], silence: Mapping[str, float], timeout: float
) -> dict[str, NodeStatus]:
    """The status of the expected nodes and of those heard.

    Args:
        heard: by fully qualified name.
        silence: s since each was heard.
        timeout: s after which a node is silent.
    """
    by_name = {name.rpartition('/')[2]: name for name in sorted(heard)}
    others = [name for name in by_name if name not in EXPECTED]
    return {
        name: _status(heard[by_name[name]], silence[by_name[name]], timeout)
        if name in by_name
        else NodeStatus('absent')
        for name in (*EXPECTED, *others)
    }


def _status(record: NodeRecord, silence: float, timeout: float) -> NodeStatus:
    rest = record.version, record.restarts
    if silence > timeout:
        return NodeStatus('silent', f'not heard for {silence:.1f} s', *rest)
    message = '' if record.state is NodeState.READY else record.message
    return NodeStatus(described(record.state, ''), message, *rest)
