"""The measurements of ``scripts/bench.py`` (like for like, tool for tool, cost laws, start-up) and their report."""
