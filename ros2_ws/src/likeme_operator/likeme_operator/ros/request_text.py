"""A request for help as text and as JSON."""

from __future__ import annotations

from typing import Any

from likeme_core.ros.time import stamp_ns
from likeme_core.ros.world import WorldNames
from likeme_inference.console_replies import WORD_OF, menu
from likeme_inference.tabletop.values import Reply, RequestKind
from likeme_msgs.msg import HelpRequest


def request_text(request: HelpRequest, names: WorldNames) -> str:
    """A request, and the answers that can be given with what follows from each."""
    goal, action = names.state(request.goal), names.action(request.action)
    return (
        f'Request {request.id}: {request.question}\n'
        f'  {request.object} is {names.state(request.x_i)}, wanted {goal}; best action {action}, '
        f'p = {request.predicted_success:.2f}, threshold {request.threshold:.2f}\n'
        + menu(request.options, request.object, goal, action, names.states)
    )


def request_json(request: HelpRequest, names: WorldNames) -> dict[str, Any]:
    """A request for programs."""
    return {
        'id': request.id,
        'object': request.object,
        'x_i': names.state(request.x_i),
        'goal': names.state(request.goal),
        'action': names.action(request.action),
        'predicted_success': request.predicted_success,
        'threshold': request.threshold,
        'question': request.question,
        'kind': RequestKind(request.kind).name if request.kind in set(RequestKind) else '?',
        'options': [WORD_OF[Reply(option)] for option in request.options if option in set(Reply)],
        'stamp': stamp_ns(request.header.stamp),
    }
