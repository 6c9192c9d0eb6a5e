"""Campaigns: airframes x missions x scenarios x seeds x overrides, flown as rehearsals on all cores or on a cluster."""
