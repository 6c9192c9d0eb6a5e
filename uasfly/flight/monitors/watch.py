"""What all monitors share: a finding has to last to count, to be gone to be over, and may grow worse by lasting."""

from __future__ import annotations

from collections.abc import Callable

from uasfly.flight.monitors.watched import Watched
from uasfly.messages import Action, Alarm
from uasfly.monitor_settings import Monitor

SEVERITIES = {
    Action.WARN: 4,
    Action.SLOW_DOWN: 4,
    Action.HOLD: 4,
    Action.BACK_OFF: 3,
    Action.END: 3,
    Action.RETURN: 3,
    Action.LAND: 3,
    Action.HAND_OVER: 2,
}


class Lasting:
    """Turns a finding now into an action: NOTHING, `action`, and `then` where that is given.

    Attributes:
        idle: nothing is found or lasts, so that another update without a finding changes nothing.
    """

    def __init__(self, settings: Monitor) -> None:
        """Take the times and actions."""
        self._settings = settings
        self._first = Action(settings.action)
        self._then = None if settings.then is None else Action(settings.then)
        self._since_s: float | None = None
        self._gone_s: float | None = None
        self._acted_s: float | None = None
        self._grown = False
        self.idle = True

    def update(self, time_s: float, found: bool) -> Action:
        """The action at `time_s`; times must not fall."""
        settings = self._settings
        if found:
            self._gone_s = None
            if self._since_s is None:
                self._since_s = time_s
            if self._acted_s is None and time_s - self._since_s >= settings.after_s:
                self._acted_s = time_s
        else:
            self._since_s = None
            if self._acted_s is not None:
                if self._gone_s is None:
                    self._gone_s = time_s
                if time_s - self._gone_s >= settings.clear_s:
                    self._acted_s = None
        self.idle = not found and self._acted_s is None
        if self._acted_s is None:
            self._grown = False
            return Action.NOTHING
        self._grown |= found and time_s - self._acted_s >= settings.then_after_s
        return self._then if self._then is not None and self._grown else self._first


class Watch:
    """One monitor: a name, its settings and a function that says what it finds ("" nothing).

    Attributes:
        find: what is found now. flying_only: looks only while uasfly flies.
        lasts: something was found or lasts: `update` wants to hear of the next look even where that finds nothing.
    """

    def __init__(
        self, name: str, settings: Monitor, find: Callable[[Watched], str], *, flying_only: bool = True
    ) -> None:
        """Take them.

        Args:
            name: as in the mission file.
            settings: times and actions.
            find: what is found now, for the pilot, "" for nothing.
            flying_only: looks only while uasfly flies.
        """
        self._name = name
        self.find = find
        self.flying_only = flying_only
        self.lasts = False
        self._lasting = Lasting(settings)
        self._alarm: Alarm | None = None

    def update(self, time_s: float, text: str) -> Alarm | None:
        """The alarm that lasts at `time_s`, the same object as long as its action does; `text` is what was found."""
        action = self._lasting.update(time_s, bool(text))
        self.lasts = not self._lasting.idle
        if action is Action.NOTHING:
            self._alarm = None
        elif self._alarm is None or self._alarm.action is not action:
            text = text or (self._alarm.text if self._alarm is not None else "")
            self._alarm = Alarm(self._name, action, SEVERITIES[action], text)
        return self._alarm
