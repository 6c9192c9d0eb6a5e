"""What is done about alarms: the highest action acts, and each is announced once when it begins, grows or is over."""

from __future__ import annotations

from uasfly.messages import Action, Alarm

NOTICE = 5
_WORDS = {
    Action.WARN: "",
    Action.SLOW_DOWN: ": slowing down",
    Action.HOLD: ": holding",
    Action.BACK_OFF: ": backing off the way it came",
    Action.END: ": ending the mission",
    Action.RETURN: ": returning",
    Action.LAND: ": landing",
    Action.HAND_OVER: ": handing over to the pilot",
}


class Response:
    """Remembers what was announced.

    Attributes:
        action: highest of the present alarms. text: of the alarm that it comes from.
        since_s: since when something keeps the vehicle from flying on.
    """

    def __init__(self) -> None:
        self.action = Action.NOTHING
        self.text = ""
        self.since_s: float | None = None
        self._alarms: tuple[Alarm, ...] = ()

    def update(self, time_s: float, alarms: tuple[Alarm, ...], acting: bool) -> list[tuple[int, str]]:
        """Take a cycle's alarms; returns announcements with their severities.

        Args:
            time_s: now.
            alarms: of the monitors.
            acting: whether actions can be done now; otherwise alarms are only told.
        """
        if not alarms and not self._alarms:  # nearly always
            return []
        known = {id(alarm) for alarm in self._alarms}
        texts = [
            (alarm.severity, alarm.text + (_WORDS[alarm.action] if acting else ""))
            for alarm in alarms
            if id(alarm) not in known
        ]
        names = {alarm.monitor for alarm in alarms}
        over = dict.fromkeys(alarm.monitor for alarm in self._alarms if alarm.monitor not in names)
        texts += [(NOTICE, f"{name.replace('_', ' ')}: over") for name in over]
        self._alarms = alarms
        worst = max(alarms, key=_grade, default=None)
        self.action = worst.action if worst is not None and acting else Action.NOTHING
        self.text = worst.text if worst is not None else ""
        if self.action not in (Action.HOLD, Action.BACK_OFF):
            self.since_s = None
        elif self.since_s is None:
            self.since_s = time_s
        return texts


def _grade(alarm: Alarm) -> int:
    return alarm.action.grade
