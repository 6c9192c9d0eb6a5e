"""The experiments of the papers, flown again: what uasfly reaches beside what they report."""
