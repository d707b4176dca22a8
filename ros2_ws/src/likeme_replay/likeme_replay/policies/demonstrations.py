"""Policies of demonstrations and of the beliefs that they lead to."""

from __future__ import annotations

from typing import Any

from likeme_core.stamps import stamp_ns
from likeme_replay.policies.policy import SAME, Found, Policy, distribution
from likeme_replay.policies.seen import stamp_of


class DemonstrationsChangeTheState(Policy):
    """A demonstration moves an object of the world from one region to another."""

    def on_demonstration(self, message: Any, _: float) -> Found:
        world = self.seen.world
        if world is not None and message.object not in list(world.objects):
            yield f'Expected an object of the world, got {message.object!r}.'
        count = self.regions or 255
        if message.x_i == message.x_f or max(message.x_i, message.x_f) >= count:
            yield f'Expected a change between two regions, got {message.x_i} to {message.x_f}.'


class DemonstrationProbabilities(Policy):
    """The probabilities of a demonstration's states sum to 1, and p(manner) is one."""

    def on_demonstration(self, message: Any, _: float) -> Found:
        yield from distribution(message.x_i_probability, self.regions, 'p(x_i)')
        yield from distribution(message.x_f_probability, self.regions, 'p(x_f)')
        if not 0 < message.manner_probability <= 1:
            yield f'Expected p(manner) up to 1, got {message.manner_probability:g}.'


class DemonstrationsTakeTime(Policy):
    """A demonstration starts before it ends, and ends before it is found complete."""

    def on_demonstration(self, message: Any, _: float) -> Found:
        start, end, stamp = stamp_ns(message.start), stamp_ns(message.end), stamp_of(message)
        if not start < end <= stamp:
            yield f'Expected start, end and stamp in this order, got {start}, {end}, {stamp} ns.'


class DemonstrationsAreSeen(Policy):
    """A demonstration has the stamp of a table state, in which its object is where it ended."""

    def on_demonstration(self, message: Any, _: float) -> Found:
        stamp = stamp_of(message)
        if self.seen.first_stamp is None or stamp < self.seen.first_stamp:
            return
        table = self.seen.tables.get(stamp)
        if table is None:
            yield f'Expected a table state of {stamp} ns, got none before the demonstration.'
            return
        states = {item.name: item.state for item in table.objects}
        if states.get(message.object, message.x_f) != message.x_f:
            yield f'Expected {message.object} in {message.x_f}, got {states[message.object]}.'


class BeliefsAreDistributions(Policy):
    """A belief sums to 1, is nowhere negative, and has one number for each region."""

    def on_goal_belief(self, message: Any, _: float) -> Found:
        yield from distribution(message.posterior, self.regions, 'the posterior')


class PriorsAreDistributions(Policy):
    """The prior of a belief sums to 1, is nowhere negative, and has one number for each region."""

    def on_goal_belief(self, message: Any, _: float) -> Found:
        yield from distribution(message.prior, self.regions, 'the prior')


class GoalIsMostProbable(Policy):
    """The goal of a belief is a region of the greatest posterior probability."""

    def on_goal_belief(self, message: Any, _: float) -> Found:
        posterior = list(message.posterior)
        if message.goal >= len(posterior):
            yield f'Expected a goal below {len(posterior)}, got {message.goal}.'
        elif posterior[message.goal] < max(posterior) - SAME:
            yield f'Expected the goal of the greatest probability, got {message.goal}.'


class BeliefsFollowDemonstrations(Policy):
    """A belief has stamp, object and change of a demonstration that was published before."""

    def on_goal_belief(self, message: Any, _: float) -> Found:
        stamp, first = stamp_of(message), self.seen.first_stamp
        if first is None or stamp < first:
            return
        shown = self.seen.demonstrations.get((stamp, message.object))
        if shown is None:
            yield f'Expected a demonstration of {message.object} at {stamp} ns, got none.'
        elif (shown.x_i, shown.x_f) != (message.x_i, message.x_f):
            change = f'{message.x_i} to {message.x_f}'
            yield f'Expected the change {shown.x_i} to {shown.x_f}, got {change}.'
