"""The fault table: every fault flown, what was expected, what happened, how soon, and how far the vehicle strayed."""
