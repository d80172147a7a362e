"""Compares truefield with its peers: same work, same run, same threads, accuracy beside time."""
