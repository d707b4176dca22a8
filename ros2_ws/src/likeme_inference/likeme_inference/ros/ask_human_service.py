"""The service ask_human: lists pending requests, takes the answers."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.node import Node

from likeme_core.repeated_line import RepeatedLine
from likeme_core.ros.time import stamp_ns
from likeme_core.world import World
from likeme_inference import messages
from likeme_inference.experience.store_error import StoreError
from likeme_inference.help_requests import (
    AcceptedAnswer,
    AnswerRefusedError,
    HelpRequests,
    ReadQuestion,
)
from likeme_msgs.srv import AskHuman


class AskHumanService:
    """Serves ask_human (AskHuman) on behalf of its node.

    Attributes:
        desk: the requests.
    """

    def __init__(
        self,
        node: Node,
        world: World,
        take: Callable[[AcceptedAnswer], None],
        refusal: Callable[[AcceptedAnswer | None], str],
    ) -> None:
        """take: applies an answer; raises StoreError: cannot be logged.

        refusal: why no answer (None), or a valid one, is not taken at present; empty: it is.
        """
        self.desk = HelpRequests()
        self._world, self._take, self._refusal = world, take, refusal
        self._logger, self._refusals = node.get_logger(), RepeatedLine()
        node.create_service(AskHuman, 'ask_human', self._on_request)

    def _on_request(
        self, request: AskHuman.Request, response: AskHuman.Response
    ) -> AskHuman.Response:
        try:
            response.message = self._serve(request)
            response.success = True
        except AnswerRefusedError as error:
            response.message = str(error)
            if line := self._refusals.line(f'Answer refused: {error}'):
                self._logger.warning(line)
        response.pending = [messages.request_msg(self._world, item) for item in self.desk.pending]
        return response

    def _serve(self, request: AskHuman.Request) -> str:
        if request.command == AskHuman.Request.LIST:
            return f'{len(self.desk.pending)} pending.'
        if request.command != AskHuman.Request.ANSWER:
            raise AnswerRefusedError(
                f'Expected command 0 LIST or 1 ANSWER, got {request.command}.'
            )
        if refusal := self._refusal(None):
            raise AnswerRefusedError(refusal)
        read = ReadQuestion(request.object, request.action, stamp_ns(request.stamp))
        try:
            goal = self._world.state(request.goal) if request.goal else None
        except ValueError as error:
            raise AnswerRefusedError(str(error)) from error
        given = (request.request_id, request.answer, request.answered_by, read, goal)
        if before := self.desk.accepted(*given):
            return before.sentence
        answer = self.desk.check(*given)
        if refusal := self._refusal(answer):
            raise AnswerRefusedError(refusal)
        try:
            self._take(answer)
        except StoreError as error:
            raise AnswerRefusedError(
                f'The answer cannot be logged, so nothing follows from it: {error}'
            ) from error
        return answer.sentence
