"""The actions after which the mission is over, as what the sequencer does about them."""

from __future__ import annotations

from uasfly.flight.choices import EndingAction
from uasfly.flight.sequencer import Sequencer
from uasfly.messages import Action

_ENDINGS = {Action.END: None, Action.RETURN: EndingAction.RETURN, Action.LAND: EndingAction.LAND}
LEAVING = frozenset({Action.HAND_OVER, *_ENDINGS})


def leave_mission(sequencer: Sequencer, time_s: float, action: Action, reason: str) -> None:
    """Do one of `LEAVING`: hand over at once, or hold and then the mission's ending or the one that it names."""
    if action is Action.HAND_OVER:
        sequencer.leave(time_s, reason)
    else:
        sequencer.end(time_s, reason, _ENDINGS[action])
