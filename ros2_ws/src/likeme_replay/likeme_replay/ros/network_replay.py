"""Replay over the network: in lockstep with the nodes, or at a rate into the graph."""

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
from likeme_replay.managed_nodes import managed_nodes, nodes_run_on
from likeme_replay.offline_replay import ReplayResult, replay_bag
from likeme_replay.playback_control import EndedByKeyError, PlaybackControl
from likeme_replay.recorded_inputs import RecordedInputs
from likeme_replay.replay_options import ReplayOptions
from likeme_replay.replay_report import print_message, report
from likeme_replay.ros.lockstep_node import LockstepNode
from likeme_replay.ros.player_node import PlayerNode, read_overrides
from likeme_replay.ros.waiting_node import ReplayFailedError
from likeme_replay.source_adapters import adapted_source


@contextmanager
def _network(domain: int) -> Iterator[None]:
    """ROS without signal handlers: Ctrl-C raises KeyboardInterrupt, so that nodes are ended."""
    # No arguments: rclpy would apply FROM:=TO of --remap a second time.
    rclpy.init(args=[], domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield
    finally:
        rclpy.try_shutdown()


def replay_in_lockstep(options: ReplayOptions) -> int:
    """Replay in lockstep with perception and inference; the exit code."""
    parameters, begin, end = options.read_bag_settings()
    with ExitStack() as stack:
        try:
            stack.enter_context(claim(options.domain, ('replay',)))
        except AlreadyRunningError as error:
            print_message(str(error))
            return 1
        nodes: Path | None = None
        if options.running or nodes_run_on(options.domain):
            print_message(
                f'Using the nodes that run on ROS domain {options.domain}, with their parameters.'
            )
        else:
            print_message(f'Starting perception and inference on ROS domain {options.domain}.')
            nodes = stack.enter_context(managed_nodes(options.domain, parameters))
        stack.enter_context(_network(options.domain))
        keys = stack.enter_context(keyboard())
        control = PlaybackControl(options.rate or 0.0, options.pause, keys, notify=print_message)
        bag = stack.enter_context(open_bag(options.bag))
        source = adapted_source(options.remap, options.types)(bag, begin, end)
        try:
            return report(options, _replay(options, RecordedInputs(source), bag, control))
        except ReplayFailedError as error:
            print_message(str(error))
            for line in _last_lines(nodes):
                print_message(line)
            return 1
        except EndedByKeyError:
            print_message('Ended by key.')
            return 1


def _replay(
    options: ReplayOptions, inputs: RecordedInputs, bag: Bag, control: PlaybackControl
) -> ReplayResult:
    node = LockstepNode(control, options.clock)
    try:
        node.begin()
        return replay_bag(inputs, bag, node)
    finally:
        # Running nodes go back to a live session, also after an error.
        node.end()
        node.close()


def _last_lines(log: Path | None) -> list[str]:
    text = '' if log is None else log.read_text(encoding='utf-8', errors='replace')
    return text.strip().splitlines()[-5:]


def play(options: ReplayOptions) -> int:
    """Play into the graph; the exit code."""
    with ExitStack() as stack:
        bag = stack.enter_context(open_bag(options.bag))
        _, begin, end = options.read_bag_settings()
        adaptation = Adaptation(options.remap, options.types)
        chosen = _chosen(options, bag)
        overrides = read_overrides(options.qos)
        stack.enter_context(_network(options.domain))
        keys = stack.enter_context(keyboard())
        rate = 1.0 if options.rate is None else options.rate
        control = PlaybackControl(rate, options.pause, keys, notify=print_message)
        node = PlayerNode(control, options.clock, overrides, print_message)
        topics = [new for old, new in zip(bag.topics, adaptation.topics(bag), strict=True)
                  if old.name in chosen]  # fmt: skip
        try:
            if not node.offer(topics, insist=bool(options.topics)):
                print_message('Expected topics to play, got none.')
                return 1
            node.wait_for_subscribers()
            while True:
                node.play(adaptation.records(bag, chosen, begin, end))
                if not options.loop or not node.published:
                    break
        except EndedByKeyError:
            print_message('Ended by key.')
        finally:
            node.finish()
    for warning in bag.warnings:
        print_message(warning)
    print_message(f'{node.published} messages played.')
    return 0 if node.published and bag.complete else 1


def _chosen(options: ReplayOptions, bag: Bag) -> list[str]:
    """The topics to play, by their names in the bag."""
    names = {topic.name for topic in bag.topics}
    wanted = {name: name for name in names} | {name.lstrip('/'): name for name in names}
    for name in options.topics:
        if name not in wanted:
            raise BagError(f'--topics {name}: expected one of {", ".join(sorted(names))}.')
    # A recorded clock would go back when looping, and compete with that of a simulation.
    return [wanted[name] for name in options.topics] or sorted(names - {'/clock'})
