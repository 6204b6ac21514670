"""The name that was probably meant where an unknown one is given: of a command, an option, a field, a file."""

from contin.lowlevel import meant as meant
