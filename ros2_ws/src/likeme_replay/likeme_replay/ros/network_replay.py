"""Replaying over the network: in lockstep with nodes, or into the graph as it is."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import rclpy
from rclpy.signals import SignalHandlerOptions

from likeme_bags.adapting import Adaptation
from likeme_bags.errors import BagError
from likeme_bags.reading import Bag, open_bag
from likeme_core.instance_lock import AlreadyRunningError, claim
from likeme_replay.keyboard import keyboard
from likeme_replay.managed_nodes import nodes_run_on, own_nodes
from likeme_replay.offline_replay import Replayed, replayed
from likeme_replay.playback_control import EndedByKeyError, Transport
from likeme_replay.recorded_inputs import Script
from likeme_replay.replay_options import Options
from likeme_replay.replay_report import conclude, say
from likeme_replay.ros.lockstep_node import LockstepNode, NotPlayedError
from likeme_replay.ros.player_node import PlayerNode, read_overrides
from likeme_replay.source_adapters import adapted


@contextmanager
def _network(domain: int) -> Iterator[None]:
    """ROS without its signal handlers: Ctrl-C ends what waits here, and things are put away."""
    # No arguments: ROS would take FROM:=TO of --remap for its own, and rename a second time.
    rclpy.init(args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield
    finally:
        rclpy.try_shutdown()


def lockstep(given: Options) -> int:
    """Replay in lockstep with perception and inference; the exit code."""
    parameters, begin, end = given.of_bag()
    with ExitStack() as stack:
        try:
            stack.enter_context(claim(given.domain, ('replay',)))
        except AlreadyRunningError as error:
            say(str(error))
            return 1
        nodes: Path | None = None
        if given.running or nodes_run_on(given.domain):
            say(f'With the nodes that run on ROS domain {given.domain}, as they are set.')
        else:
            say(f'With a perception and an inference of its own on ROS domain {given.domain}.')
            nodes = stack.enter_context(own_nodes(given.domain, parameters))
        stack.enter_context(_network(given.domain))
        keys = stack.enter_context(keyboard())
        transport = Transport(given.rate or 0.0, given.pause, keys, say=say)
        bag = stack.enter_context(open_bag(given.bag))
        script = Script(adapted(given.remap, given.types)(bag, begin, end))
        try:
            return conclude(given, _performed(given, script, bag, transport))
        except NotPlayedError as error:
            say(str(error))
            for line in _last_words(nodes):
                say(line)
            return 1
        except EndedByKeyError:
            say('Ended by key.')
            return 1


def _performed(given: Options, script: Script, bag: Bag, transport: Transport) -> Replayed:
    node = LockstepNode(transport, given.clock)
    try:
        node.begin()
        return replayed(script, bag, node)
    finally:
        # However it went, nodes that run on are let go.
        node.end()
        node.close()


def _last_words(log: Path | None) -> list[str]:
    text = '' if log is None else log.read_text(encoding='utf-8', errors='replace')
    return text.strip().splitlines()[-5:]


def play(given: Options) -> int:
    """Play into the graph; the exit code."""
    with ExitStack() as stack:
        bag = stack.enter_context(open_bag(given.bag))
        _, begin, end = given.of_bag()
        adaptation = Adaptation(given.remap, given.types)
        chosen = _chosen(given, bag)
        overrides = read_overrides(given.qos)
        stack.enter_context(_network(given.domain))
        keys = stack.enter_context(keyboard())
        transport = Transport(
            1.0 if given.rate is None else given.rate, given.pause, keys, say=say
        )
        node = PlayerNode(transport, given.clock, overrides, say)
        topics = [new for old, new in zip(bag.topics, adaptation.topics(bag), strict=True)
                  if old.name in chosen]  # fmt: skip
        try:
            if not node.offer(topics, insist=bool(given.topics)):
                say('Expected topics to play, got none.')
                return 1
            node.wait_for_listeners()
            while True:
                node.play(adaptation.records(bag, chosen, begin, end))
                if not given.loop or not node.published:
                    break
        except EndedByKeyError:
            say('Ended by key.')
        finally:
            node.finish()
    for warning in bag.warnings:
        say(warning)
    say(f'{node.published} messages played.')
    return 0 if node.published and bag.complete else 1


def _chosen(given: Options, bag: Bag) -> list[str]:
    """The topics to play, by their names in the bag."""
    names = {topic.name for topic in bag.topics}
    wanted = {name: name for name in names} | {name.lstrip('/'): name for name in names}
    for name in given.topics:
        if name not in wanted:
            raise BagError(f'--topics {name}: expected one of {", ".join(sorted(names))}.')
    # A recorded clock would go back with every round, and beside a simulation's own be a second.
    return [wanted[name] for name in given.topics] or sorted(names - {'/clock'})
