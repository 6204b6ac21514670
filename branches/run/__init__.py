"""``python -m branches.run CONFIG``: follow scenes, and write their results."""


def main(argv=None) -> int:
    """Run the command ``ribbon run``; return its exit code."""
    from branches.run.__main__ import main as command  # nothing is imported before it is known what to do

    return command(argv)
