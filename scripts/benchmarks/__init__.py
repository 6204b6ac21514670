"""What ``scripts/bench.py`` measures: like for like, tool for tool, cost laws, start-up; and how it is written down."""
