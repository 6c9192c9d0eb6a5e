"""Flight log writer and readers."""
