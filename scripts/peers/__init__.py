"""Other programs on the problems of this project, each used as its own users would. The packages do not use this."""
