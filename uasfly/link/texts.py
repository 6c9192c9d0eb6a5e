"""Status texts of the vehicle, joined from their chunks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from uasfly.link.encode import TEXT_BYTES

PATIENCE_S = 0.5
CHUNKS = 256  # chunk_seq is a byte: no text has more


@dataclass(slots=True)
class _Unfinished:
    severity: int
    arrival_s: float
    chunks: list[str] = field(default_factory=list)


class TextAssembler:
    """Joins the chunks of STATUSTEXT (equal `id`, rising `chunk_seq`); a chunk of less than 50 bytes ends a text.

    PX4 does not end a text whose length is a multiple of 50: such a text is complete when half a second has passed.
    A lost chunk is shown as "...".
    """

    def __init__(self) -> None:
        self._unfinished: dict[int, _Unfinished] = {}

    def add(self, fields: Mapping[str, Any], arrival_s: float) -> tuple[int, str] | None:
        """Take one STATUSTEXT.

        Returns:
            Severity (0..7) and the whole text when it is complete, else None.
        """
        severity, text = int(fields["severity"]), str(fields["text"])
        identity, sequence = int(fields.get("id", 0)), int(fields.get("chunk_seq", 0))
        if not 0 <= sequence < CHUNKS:
            raise ValueError(f"expected a chunk_seq in 0..{CHUNKS - 1}, found {sequence}")
        ends = len(text.encode()) < TEXT_BYTES
        if identity == 0 or (sequence == 0 and ends):
            return severity, one_line(text)
        entry = self._unfinished.setdefault(identity, _Unfinished(severity, arrival_s))
        entry.chunks.extend(["..."] * (sequence - len(entry.chunks)))
        entry.chunks.append(text)
        entry.arrival_s = arrival_s
        return self._finish(identity) if ends or len(entry.chunks) >= CHUNKS else None

    def overdue(self, now_s: float) -> list[tuple[int, str]]:
        """Texts whose last chunk came more than half a second ago: no further one will come."""
        late = [identity for identity, entry in self._unfinished.items() if now_s - entry.arrival_s > PATIENCE_S]
        return [self._finish(identity) for identity in late]

    def _finish(self, identity: int) -> tuple[int, str]:
        entry = self._unfinished.pop(identity)
        return entry.severity, one_line("".join(entry.chunks))


def one_line(text: str) -> str:
    """One line that may go to a terminal: PX4 ends texts that are events too with a tab, others send what they like."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())
