"""The fuzzing campaign.

python -m tests.fuzz --inputs 200000 --seed 1        # everything, on all cores
python -m tests.fuzz --target mission --inputs 5000  # one target
python -m tests.fuzz --target mission --repeat 1234  # one input, with its block before it
"""

from __future__ import annotations

import argparse
import os
import sys

from tests.fuzz.campaign import TARGETS, run
from tests.fuzz.harness import Tally


def main() -> int:
    """Run what the flags ask for; 1 when there is a finding."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz")
    parser.add_argument("--inputs", type=int, default=200_000, help="in all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--target", action="append", choices=list(TARGETS), help="all when not given")
    parser.add_argument("--repeat", type=int, help="index of one input of one target")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--show", type=int, default=20, help="findings to show")
    flags = parser.parse_args()
    names = flags.target or list(TARGETS)
    tallies = run(names, flags.inputs, flags.seed, flags.processes, flags.repeat)
    print(table(tallies))
    findings = [finding for tally in tallies.values() for finding in tally.findings]
    for finding in findings[: flags.show]:
        print(f"\n--target {finding.target} --seed {finding.seed} --repeat {finding.index}\n{finding.text}")
    return 1 if findings else 0


def table(tallies: dict[str, Tally]) -> str:
    """What has come of it, a line a target."""
    total = Tally()
    for tally in tallies.values():
        total.add(tally)
    rows = [f"{'target':12}{'inputs':>9}{'accepted':>10}{'refused':>9}{'findings':>10}{'slowest s':>11}"]
    for name, tally in (*tallies.items(), ("all", total)):
        counts = f"{tally.inputs:9}{tally.accepted:10}{tally.refused:9}{len(tally.findings):10}"
        rows.append(f"{name:12}{counts}{tally.slowest_s:11.3f}")
    return "\n".join(rows)


if __name__ == "__main__":
    sys.exit(main())
