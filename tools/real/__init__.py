"""Recordings that nobody here made: which there are, how they become ours, and how the estimates on them are judged."""
