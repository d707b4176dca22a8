"""For each policy, by its name, a trace that keeps it, and with `bad` one that breaks it alone."""

from __future__ import annotations

from policy_traces import BY_NOBODY, MOTION, NOTHING_MOVED, UNSURE, Trace, question


def holds_only_grow(t: Trace, bad: bool) -> None:
    t.hold(change=2)
    t.hold(change=1 if bad else 2)


def hold_is_latched(t: Trace, bad: bool) -> None:
    t.hold(held=True, change=1)
    t.hold(change=1 if bad else 2)
    t.told(change=2)


def holds_say_the_same(t: Trace, bad: bool) -> None:
    t.told(held=True, change=1)
    t.told(held=not bad, change=1)


def holds_are_told(t: Trace, bad: bool) -> None:
    t.hold(change=1)
    t.hold(held=True, change=2)
    if not bad:
        t.told(held=True, change=2)
    t.wait(3)


def keeper_comes_back(t: Trace, bad: bool) -> None:
    t.hold()
    t.wait(11 if bad else 9)
    t.hold()


def joints_rest_while_held(t: Trace, bad: bool) -> None:
    t.hold(held=True)
    t.joints(0.5)
    t.hold(held=True)
    t.hold(held=True)
    t.joints(0.5 if bad else 0.0)


def joints_rest_unheard(t: Trace, bad: bool) -> None:
    t.hold()
    for number in range(20):
        t.joints(0.5 if bad or number < 9 else 0.0)


def motions_begin_once(t: Trace, bad: bool) -> None:
    t.motion(id='x')
    t.motion(2, id='x')
    t.motion(id='x' if bad else 'y')


def motions_end_once(t: Trace, bad: bool) -> None:
    t.motion(2, id='lost', outcome=13)
    t.motion(id='x')
    t.motion(2, id='x')
    t.motion(2, id='x', outcome=1 if bad else 0)


def motions_end_in_time(t: Trace, bad: bool) -> None:
    t.motion(id='x')
    t.wait(130 if bad else 100)
    t.motion(2, id='x')


def one_motion_at_a_time(t: Trace, bad: bool) -> None:
    t.motion(id='x')
    t.motion(id='person', actor=1)
    if not bad:
        t.motion(2, id='x')
    t.motion(id='y')


def motions_take_time(t: Trace, bad: bool) -> None:
    t.motion(id='x')
    t.motion(2, id='x', message='' if bad else 'done')


def acts_on_decisions_alone(t: Trace, bad: bool) -> None:
    t.asked()
    if not bad:
        t.heard(3, answer=1)
    t.motion()


def acts_as_decided(t: Trace, bad: bool) -> None:
    t.decided()
    t.motion(action='PUSH_LEFT' if bad else 'push_right')


def one_motion_a_decision(t: Trace, bad: bool) -> None:
    t.moved()
    if bad:
        t.motion(id='decision-1-b')


def no_motion_after_the_outcome(t: Trace, bad: bool) -> None:
    time = t.decided()
    if bad:
        t.outcome(time, result=3, x_f=255, motion_outcome=255)
    t.motion()


def no_motion_begins_while_held(t: Trace, bad: bool) -> None:
    t.hold(held=True)
    for _ in range(3):
        t.hold(held=True)
    t.motion(id='x')
    t.motion(2, id='x', outcome=3, **({} if bad else NOTHING_MOVED))


def no_motion_begins_unheard(t: Trace, bad: bool) -> None:
    t.hold()
    t.wait(1)
    t.motion(id='x')
    if not bad:
        t.hold()
    t.motion(2, id='x')


def held_motions_end(t: Trace, bad: bool) -> None:
    t.motion(id='x')
    t.hold(held=True)
    if not bad:
        t.motion(2, id='x', outcome=3)
    t.wait(3)


def one_world(t: Trace, bad: bool) -> None:
    t.world()
    t.table(world='rooms@e' if bad else 'toys@d')


def world_stays(t: Trace, bad: bool) -> None:
    t.world()
    t.world(digest='e' if bad else 'd')


def every_object_listed(t: Trace, bad: bool) -> None:
    t.world()
    t.table(objects=[t.item('pear'), t.item('pear' if bad else 'bear')])


def state_probabilities(t: Trace, bad: bool) -> None:
    t.world()
    item = t.item(state_probability=[0.5, 0.3, 0.1 if bad else 0.2])
    t.table(objects=[item, t.item('bear')])


def states_are_regions(t: Trace, bad: bool) -> None:
    t.world()
    t.table(3 if bad else 255)


def settled_table_rests(t: Trace, bad: bool) -> None:
    t.table(arm_in_view=bad)


def seen_objects_have_times(t: Trace, bad: bool) -> None:
    late = t.item().last_seen
    t.table(objects=[t.item(last_seen=late if not bad else t.item().last_seen, visible=True)])
    if bad:
        t.table(time=t.now + 0.5, objects=[t.item()])


def stamps_rise(t: Trace, bad: bool) -> None:
    time = t.table()
    t.table(time=time - (0.5 if bad else 2))


def frames_done_once(t: Trace, bad: bool) -> None:
    first, second = t.table(), t.table()
    t.frame_done(first)
    t.frame_done(first if bad else second)


def frames_read_are_told(t: Trace, bad: bool) -> None:
    time = t.table()
    t.frame_done(time + 0.03, table_state=bad)


def demonstrations_change_the_state(t: Trace, bad: bool) -> None:
    t.world()
    t.demonstration(t.table(1), x_i=1 if bad else 0)


def demonstration_probabilities(t: Trace, bad: bool) -> None:
    t.world()
    t.demonstration(t.table(1), x_f_probability=[0.0, 1.0, 0.2 if bad else 0.0])


def demonstrations_take_time(t: Trace, bad: bool) -> None:
    time = t.table(1)
    t.demonstration(time, **({'start': t.item().last_seen} if bad else {}))


def demonstrations_are_seen(t: Trace, bad: bool) -> None:
    t.demonstration(t.table(2 if bad else 1))


def beliefs_are_distributions(t: Trace, bad: bool) -> None:
    time = t.table(1)
    t.demonstration(time)
    t.belief(time, posterior=[0.1, 0.7, 0.3 if bad else 0.2])


def priors_are_distributions(t: Trace, bad: bool) -> None:
    time = t.table(1)
    t.demonstration(time)
    t.belief(time, prior=[0.4, 0.3, 0.3] if not bad else [0.8, -0.1, 0.3])


def goal_is_most_probable(t: Trace, bad: bool) -> None:
    time = t.table(1)
    t.demonstration(time)
    t.belief(time, goal=2 if bad else 1)


def beliefs_follow_demonstrations(t: Trace, bad: bool) -> None:
    time = t.table(1)
    t.demonstration(time)
    t.belief(time, x_f=2 if bad else 1)


def decisions_follow_demonstrations(t: Trace, bad: bool) -> None:
    shown = t.table(1)
    if not bad:
        t.demonstration(shown)
    t.decision(t.table(0), shown)


def decision_ids_count_up(t: Trace, bad: bool) -> None:
    shown, at_goal = t.shown(), {'kind': 2, 'action': 255, 'predicted': [], 'x_i': 1}
    t.decision(t.table(1), shown, **at_goal)
    t.decision(t.table(0), shown, id=3 if bad else 2)


def decisions_stay(t: Trace, bad: bool) -> None:
    shown = t.shown()
    time = t.table(0)
    t.decision(time, shown)
    t.decision(time, shown, mode='sequential' if bad else 'interactive')


def decisions_keep_the_belief(t: Trace, bad: bool) -> None:
    shown = t.shown()
    if not bad:
        t.parameters_changed()
    t.decision(t.table(0), shown, goal_posterior=[0.2, 0.6, 0.2])


def decided_goal_is_most_probable(t: Trace, bad: bool) -> None:
    shown = t.table(1)
    t.demonstration(shown)
    posterior = [0.1, 0.2, 0.7] if bad else [0.1, 0.7, 0.2]
    t.decision(t.table(0), shown, goal_posterior=posterior)


def predicted_is_distribution(t: Trace, bad: bool) -> None:
    t.decided(predicted=[0.2 if bad else 0.1, 0.9, 0.0])


def predicted_success_is_of_the_goal(t: Trace, bad: bool) -> None:
    t.decided(predicted_success=0.8 if bad else 0.9)


def action_probabilities(t: Trace, bad: bool) -> None:
    t.decided(action_probability=[0.2 if bad else 0.0, 0.0])


def action_is_known(t: Trace, bad: bool) -> None:
    t.decided(action=2 if bad else 1)


def at_goal_is_at_the_goal(t: Trace, bad: bool) -> None:
    shown = t.shown()
    t.decision(t.table(1), shown, kind=2, action=255, predicted=[], x_i=1)
    if bad:
        t.decision(t.table(1), shown, id=2, x_i=1)


def asks_only_below_the_threshold(t: Trace, bad: bool) -> None:
    t.decided(**UNSURE | {'threshold': 0.2 if bad else 0.5})


def acts_only_at_the_threshold(t: Trace, bad: bool) -> None:
    t.decided(threshold=0.95 if bad else 0.9)


def only_asking_modes_ask(t: Trace, bad: bool) -> None:
    t.decided(**UNSURE, mode='goal_based' if bad else 'interactive')


def budget_counts_down(t: Trace, bad: bool) -> None:
    shown = t.shown()
    t.decision(t.table(0), shown, mode='sequential', actions_left=3)
    t.motion()
    t.motion(2)
    t.outcome(t.table(0), x_f=0, result=1)
    t.decision(t.table(0), shown, id=2, mode='sequential', actions_left=3 if bad else 2)


def decides_on_a_settled_table(t: Trace, bad: bool) -> None:
    shown = t.shown()
    time = t.table(2 if bad else 0)
    t.decision(time, shown)
    t.outcome(t.table(0), result=3, x_f=255, motion_outcome=255)
    for _ in range(1001):
        t.table(0)
    t.decision(time, shown)


def one_decision_at_a_time(t: Trace, bad: bool) -> None:
    shown = t.shown()
    time = t.table(0)
    t.decision(time, shown)
    if not bad:
        t.outcome(time, result=3, x_f=255, motion_outcome=255)
    t.decision(t.table(0), shown, id=2)


def outcomes_of_decisions(t: Trace, bad: bool) -> None:
    t.moved()
    t.outcome(t.table(1), x_i=2 if bad else 0)


def outcomes_once(t: Trace, bad: bool) -> None:
    t.moved()
    time = t.table(1)
    t.outcome(time)
    t.outcome(time)
    if bad:
        t.outcome(t.table(1))


def outcomes_are_seen(t: Trace, bad: bool) -> None:
    t.moved()
    time = t.table(1, settled=not bad)
    t.outcome(time)
    for _ in range(1001):
        t.table(1)
    t.outcome(time)


def reached_is_at_the_goal(t: Trace, bad: bool) -> None:
    t.moved()
    t.outcome(t.table(1), result=1 if bad else 0)


def outcomes_name_the_act(t: Trace, bad: bool) -> None:
    t.moved()
    t.outcome(t.table(1), action=0 if bad else 1)


def ended_by_an_answer(t: Trace, bad: bool) -> None:
    time = t.decided() if bad else t.asked()
    t.outcome(time, result=5, x_f=255, actor=2, **BY_NOBODY)


def asked_after_not_free(t: Trace, other_action: bool) -> None:
    """A push that was not free, and the question for the way; or by another action's name."""
    shown = t.shown()
    t.decision(t.table(0), shown, mode='sequential', actions_left=3)
    t.motion()
    t.motion(2, outcome=14, **NOTHING_MOVED)
    t.outcome(t.table(0), x_f=255, result=3, motion_outcome=14)
    changes = {'action': 0, 'success_probability': [0.9, 0.9]} if other_action else {}
    t.decision(t.table(0), shown, id=2, kind=1, mode='sequential', actions_left=3, **changes)


def outcomes_agree_with_the_arm(t: Trace, bad: bool) -> None:
    t.moved()
    t.outcome(t.table(1), motion_outcome=1 if bad else 0)


def looks_after_the_motion(t: Trace, bad: bool) -> None:
    t.decided()
    t.motion()
    early = t.table(1)
    t.motion(2)
    t.outcome(early if bad else t.table(1))


def every_motion_is_followed_up(t: Trace, bad: bool) -> None:
    t.moved()
    if not bad:
        t.outcome(t.table(1))
    t.wait(31)


def every_act_is_tried(t: Trace, bad: bool) -> None:
    t.asked()
    t.heard(3, answer=1)
    if not bad:
        t.motion()
    t.wait(20)


def arm_failed_moved_nothing(t: Trace, bad: bool) -> None:
    time = t.decided()
    t.outcome(time, result=3, x_f=255, motion_outcome=13 if bad else 4)


def questions_are_asked(t: Trace, bad: bool) -> None:
    time = t.asked()
    t.questions()
    t.wait(5)
    t.questions(*([] if bad else [question(time)]))
    t.wait(20)


def questions_stay_open(t: Trace, bad: bool) -> None:
    asking = question(t.asked())
    t.questions(asking)
    t.questions(*([] if bad else [asking]))
    t.heard(3)
    t.questions()


def questions_are_of_decisions(t: Trace, bad: bool) -> None:
    t.questions(question(t.asked(), action=0 if bad else 1))


def answered_questions_close(t: Trace, bad: bool) -> None:
    asking = question(t.asked())
    t.questions(asking)
    t.heard(3)
    t.questions(asking)
    t.questions(*([asking] if bad else []))


def answers_count_once(t: Trace, bad: bool) -> None:
    time = t.asked()
    t.outcome(time, result=4, x_f=255, actor=2, **BY_NOBODY)
    t.heard(3, answer=2)
    t.heard(3, answer=2, refused=not bad)


def answers_have_a_name(t: Trace, bad: bool) -> None:
    t.asked()
    t.heard(3, message='' if bad else 'ann')


def inputs_count_up(t: Trace, bad: bool) -> None:
    t.heard(4)
    t.heard(4, number=3 if bad else 2)
    t.heard(4, number=1)
    t.heard(4, number=2)


def events_never_fall(t: Trace, bad: bool) -> None:
    t.heard(4, events=2)
    t.heard(4, events=1 if bad else 2)


def refused_inputs_change_nothing(t: Trace, bad: bool) -> None:
    t.heard(4, events=2)
    t.heard(4, events=3, refused=bad)


def inputs_were_published(t: Trace, bad: bool) -> None:
    t.beat(1)
    time = t.table()
    t.heard(0, time)
    t.heard(0, time + 0.01)
    t.beat(2, run='a' if bad else 'b')
    t.wait(9.0)
    t.beat(3, run='a' if bad else 'b')
    t.wait(2.0)


def demonstrations_are_heard(t: Trace, bad: bool) -> None:
    time = t.table(1)
    t.heard(0, time)
    t.demonstration(time)
    t.heard(0 if bad else 1, time)
    for _ in range(6):
        t.wait(1.9)
        t.heard(0, time)


def heartbeats_count_up(t: Trace, bad: bool) -> None:
    t.beat(2)
    t.beat(2 if bad else 3)


def ended_runs_stay_ended(t: Trace, bad: bool) -> None:
    t.beat(1)
    t.beat(1, run='b')
    t.beat(2, run='a' if bad else 'b')


def dead_nodes_come_back(t: Trace, bad: bool) -> None:
    t.beat(1)
    t.wait(11 if bad else 9)
    t.beat(2, state=3)
    t.wait(20)


def one_version(t: Trace, bad: bool) -> None:
    t.beat(1)
    t.beat(1, node='/perception', version='2' if bad else '1')


def reasons_are_given(t: Trace, bad: bool) -> None:
    t.beat(1, state=2, message='' if bad else 'The disk is full.')


def whole_story(t: Trace) -> None:
    """A question, an answer to try, the motion and its outcome: no policy is broken."""
    asked = t.asked()
    t.hold()
    t.questions(question(asked))
    t.heard(3, answer=1)
    t.hold()
    t.motion(id=MOTION)
    t.joints(0.5)
    t.hold(held=True, change=2)
    t.told(held=True, change=2)
    t.motion(2, outcome=3)
    t.joints()
    t.hold(change=3)
    t.told(change=3)
    t.outcome(t.table(0), x_f=0, result=1, motion_outcome=3, predicted_success=0.3)
    t.questions()
    t.wait(8)


def question_beside_another_decision(t: Trace, bad: bool = False) -> None:
    """A question about the pear waits while the bear is moved, and is then tried.

    bad: the bear is asked about, too, and is decided on again before that is answered.
    """
    asked = t.asked()
    t.questions(question(asked))
    shown = t.table(bear=1)
    bear = {'object': 'bear'}
    t.demonstration(shown, **bear)
    t.belief(shown, **bear)
    then = t.table(0)
    t.decision(then, shown, id=2, **bear | (UNSURE if bad else {}))
    t.questions(question(asked))
    if bad:
        t.decision(t.table(0), shown, id=3, **bear)
        return
    second = {'id': 'decision-2-b', **bear}
    t.motion(**second)
    t.motion(2, **second)
    t.outcome(t.table(bear=1), decision_id=2, **bear)
    t.heard(3, answer=1, object='pear')
    t.motion()
    t.motion(2)
    t.outcome(t.table(1), predicted_success=0.3)
    t.questions()
    t.wait(8)
